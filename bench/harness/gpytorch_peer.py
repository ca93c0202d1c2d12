"""GPyTorch's exact Gaussian process on the CPU. Imported only for `bench/run --with-gpytorch`."""

import gpytorch
import torch

from .clouds import Floats


class Exact(gpytorch.models.ExactGP):
    """An exact Gaussian process with zero mean and a Matérn 5/2 kernel of fixed length scale."""

    def __init__(
        self,
        points: torch.Tensor,
        values: torch.Tensor,
        likelihood: gpytorch.likelihoods.Likelihood,
        length_scale: float,
    ) -> None:
        super().__init__(points, values, likelihood)
        self.mean_module = gpytorch.means.ZeroMean()
        self.covar_module = gpytorch.kernels.MaternKernel(nu=2.5)
        self.covar_module.lengthscale = length_scale

    def forward(self, points: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(points), self.covar_module(points))


def posterior(points: Floats, values: Floats, queries: Floats, length_scale: float, alpha: float) -> tuple[Floats, Floats]:
    """Returns means and standard deviations of the latent function in float64, by Cholesky at every size."""
    x, y, z = (torch.from_numpy(array).double() for array in (points, values, queries))
    likelihood = gpytorch.likelihoods.FixedNoiseGaussianLikelihood(torch.full((len(points),), alpha, dtype=torch.float64))
    model = Exact(x, y, likelihood, length_scale).double().eval()
    # By default GPyTorch raises smaller noise to 1e-4, and uses iterative solvers beyond some hundred points.
    with (
        torch.no_grad(),
        gpytorch.settings.min_fixed_noise(double_value=alpha),
        gpytorch.settings.fast_computations(False, False, False),
    ):
        result = model(z)
        return result.mean.numpy(), result.variance.sqrt().numpy()
