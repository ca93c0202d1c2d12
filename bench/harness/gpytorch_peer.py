"""GPyTorch's Gaussian process on the CPU. Imported only with `--with-gpytorch`."""

import gpytorch
import torch

from .clouds import Floats


class Process(gpytorch.models.ExactGP):
    """A Gaussian process with zero mean and a kernel without free parameters."""

    def __init__(
        self,
        points: torch.Tensor,
        values: torch.Tensor,
        likelihood: gpytorch.likelihoods.Likelihood,
        kernel: gpytorch.kernels.Kernel,
    ) -> None:
        super().__init__(points, values, likelihood)
        self.mean_module = gpytorch.means.ZeroMean()
        self.covar_module = kernel

    def forward(self, points: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(points), self.covar_module(points))


def matern(length_scale: float) -> gpytorch.kernels.Kernel:
    """Matérn 5/2."""
    kernel = gpytorch.kernels.MaternKernel(nu=2.5)
    kernel.lengthscale = length_scale
    return kernel


def gauss(length_scale: float) -> gpytorch.kernels.Kernel:
    """exp(−r²/ℓ²), as ours."""
    kernel = gpytorch.kernels.RBFKernel()
    kernel.lengthscale = length_scale / 2**0.5
    return kernel


def posterior(
    points: Floats, values: Floats, queries: Floats, kernel: gpytorch.kernels.Kernel, alpha: float
) -> tuple[Floats, Floats]:
    """Returns means and standard deviations of the latent function in float64, by Cholesky at every size."""
    with gpytorch.settings.fast_computations(False, False, False):
        result = predict(points, values, queries, kernel, alpha)
        return result.mean.numpy(), result.variance.sqrt().numpy()


def mean(points: Floats, values: Floats, queries: Floats, kernel: gpytorch.kernels.Kernel, alpha: float) -> Floats:
    """Returns means in float64 as GPyTorch comes: beyond 800 points it iterates, to a residual of 0.01."""
    with gpytorch.settings.skip_posterior_variances():
        return predict(points, values, queries, kernel, alpha).mean.numpy()


def predict(
    points: Floats, values: Floats, queries: Floats, kernel: gpytorch.kernels.Kernel, alpha: float
) -> gpytorch.distributions.MultivariateNormal:
    x, y, z = (torch.from_numpy(array).double() for array in (points, values, queries))
    likelihood = gpytorch.likelihoods.FixedNoiseGaussianLikelihood(torch.full((len(points),), alpha, dtype=torch.float64))
    model = Process(x, y, likelihood, kernel.double()).double().eval()
    # By default it raises smaller noise to 1e-4.
    with torch.no_grad(), gpytorch.settings.min_fixed_noise(double_value=alpha):
        return model(z)
