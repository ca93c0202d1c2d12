"""Answers: arrays with the shapes documented here, and what the service says of them.

n is the number of points of the cloud, d their dimension, m the number of queries and k that of lists of values; L is
the unit of the coordinates and V that of the values. Arrays keep the order of the request, are read-only views of the
answer's bytes (`.copy()` them to change them), and have NaN where there is no meaningful number; `degenerate` then says
why. Answers can be pickled and used by several threads. `repr` shows arrays by their shapes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from .describe import described
from .fit import (
    Fit,
    OperatorFit,
    ValuesFit,
    batch_fit_used,
    fit_used,
    operator_fit_used,
    selected_fit,
    values_fit_used,
)
from .rest.models import Degenerate, Diagnostics, FamilyScore, KernelUsed, SurfaceUsed
from .sparse import csr_matrices
from .tensors import Array, Members

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


class Answer:
    """What all answers have in common: they show arrays by their shapes, and leave out what is absent."""

    def __repr__(self) -> str:
        # The fit repeats the diagnostics and the request.
        members = {name: value for name, value in vars(self).items() if name != "fit"}
        return described(type(self).__name__, members)


@dataclass(frozen=True, eq=False, repr=False)
class Interpolation(Answer):
    """A function u through the values (close to them, if `alpha` > 0), at the queries.

    Attributes
    ----------
    values
        `[m]`, V. u at each query.
    gradients
        `[m, d]`, V/L. ∇u, with `derivatives` of 1 or 2.
    hessians
        `[m, d, d]`, V/L². D²u, with `derivatives` of 2.
    value_deviations, gradient_deviations, hessian_deviations
        Standard deviations of these given the values, of the same shapes, with `deviations`.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All that was fitted with: `**answer.fit` in a call repeats it.
    """

    values: Array
    gradients: Array | None
    hessians: Array | None
    value_deviations: Array | None
    gradient_deviations: Array | None
    hessian_deviations: Array | None
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/interpolation`."""
        d = members.diagnostics.dimension
        return cls(
            values=members.array("values"),
            gradients=members.optional("gradients", d),
            hessians=members.optional("hessians", d, d),
            value_deviations=members.optional("value_deviations"),
            gradient_deviations=members.optional("gradient_deviations", d),
            hessian_deviations=members.optional("hessian_deviations", d, d),
            diagnostics=members.diagnostics,
            fit=values_fit_used(members.diagnostics, members.request),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Posterior(Answer):
    """A Gaussian process given the values, at the queries. What was not asked for is None.

    Attributes
    ----------
    means
        `[m]`, V.
    variances
        `[m]`, V². Of the latent function, no noise added; ≥ 0.
    observation_variances
        `[m]`, V². Of a new, noisy observation.
    covariance
        `[m, m]`, V². Of the latent function between queries.
    gradients
        `[m, d]`, V/L. Of the mean.
    gradient_variances
        `[m, d]`, V²/L². Of the components of the latent function's gradient.
    samples
        `[count, m]`, V. Joint draws of the latent function.
    quantiles
        `[q, m]`, V. Of the latent function.
    exceedance_probabilities
        `[m]`. That a new, noisy observation exceeds `threshold`.
    log_marginal_likelihood
        −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All that was fitted with: `**answer.fit` in a call repeats it.
    """

    means: Array
    variances: Array | None
    observation_variances: Array | None
    covariance: Array | None
    gradients: Array | None
    gradient_variances: Array | None
    samples: Array | None
    quantiles: Array | None
    exceedance_probabilities: Array | None
    log_marginal_likelihood: float | None
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/posterior`."""
        diagnostics = members.diagnostics
        return cls(
            means=members.array("means"),
            variances=members.optional("variances"),
            observation_variances=members.optional("observation_variances"),
            covariance=members.optional("covariance", diagnostics.n_queries),
            gradients=members.optional("gradients", diagnostics.dimension),
            gradient_variances=members.optional("gradient_variances", diagnostics.dimension),
            samples=members.optional("samples", diagnostics.n_queries),
            quantiles=members.optional("quantiles", diagnostics.n_queries),
            exceedance_probabilities=members.optional("exceedance_probabilities"),
            log_marginal_likelihood=members.fields.get("log_marginal_likelihood"),
            diagnostics=diagnostics,
            fit=values_fit_used(diagnostics, members.request),
        )


@dataclass(frozen=True, eq=False, repr=False)
class InterpolationBatch(Answer):
    """Functions through lists of values (close to them, if `alpha` > 0), at the queries. Deviations are those of each.

    Attributes
    ----------
    values
        `[k, m]`, V. For each list u at each query.
    gradients
        `[k, m, d]`, V/L. For each list ∇u, with `derivatives` of 1 or 2.
    hessians
        `[k, m, d, d]`, V/L². For each list D²u, with `derivatives` of 2.
    value_deviations
        `[m]`, V. Standard deviation of any of the functions given its values, with `deviations`.
    gradient_deviations
        `[m, d]`, V/L. Of the components of any ∇u.
    hessian_deviations
        `[m, d, d]`, V/L². Of the entries of any D²u.
    mean_coefficients
        `[k, p]`. For each list its mean: the constant, V, then a slope for each coordinate, V/L, if it is linear; None
        if it is zero.
    diagnostics
        The kernel and α used, how the system was solved, and how well: `relative_residual` is the greatest of all.
    fit
        All that was fitted with: `**answer.fit` in a call repeats it.
    """

    values: Array
    gradients: Array | None
    hessians: Array | None
    value_deviations: Array | None
    gradient_deviations: Array | None
    hessian_deviations: Array | None
    mean_coefficients: Array | None
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/interpolation/batch`."""
        diagnostics = members.diagnostics
        m, d = diagnostics.n_queries, diagnostics.dimension
        mean_coefficients = members.optional_arrays("mean_coefficients")
        return cls(
            values=members.array("values", m),
            gradients=members.optional("gradients", m, d),
            hessians=members.optional("hessians", m, d, d),
            value_deviations=members.optional("value_deviations"),
            gradient_deviations=members.optional("gradient_deviations", d),
            hessian_deviations=members.optional("hessian_deviations", d, d),
            mean_coefficients=mean_coefficients,
            diagnostics=diagnostics,
            fit=batch_fit_used(diagnostics, members.request, mean_coefficients),
        )


@dataclass(frozen=True, eq=False, repr=False)
class PosteriorBatch(Answer):
    """Gaussian processes given lists of values, at the queries. What was not asked for is None.

    What depends on the values has a row for each list; the rest they share.

    Attributes
    ----------
    means
        `[k, m]`, V.
    variances
        `[m]`, V². Of any of the latent functions, no noise added; ≥ 0.
    observation_variances
        `[m]`, V². Of a new, noisy observation of any of them.
    covariance
        `[m, m]`, V². Of any of the latent functions between queries.
    gradients
        `[k, m, d]`, V/L. Of the means.
    gradient_variances
        `[m, d]`, V²/L². Of the components of any latent function's gradient.
    samples
        `[k, count, m]`, V. Joint draws of each latent function.
    quantiles
        `[k, q, m]`, V. Of each latent function.
    exceedance_probabilities
        `[k, m]`. That a new, noisy observation exceeds `threshold`.
    log_marginal_likelihoods
        `[k]`. −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π of each list.
    mean_coefficients
        `[k, p]`. For each list its mean: the constant, V, then a slope for each coordinate, V/L, if it is linear; None
        if it is zero.
    diagnostics
        The kernel and α used, how the system was solved, and how well: `relative_residual` is the greatest of all.
    fit
        All that was fitted with: `**answer.fit` in a call repeats it.
    """

    means: Array
    variances: Array | None
    observation_variances: Array | None
    covariance: Array | None
    gradients: Array | None
    gradient_variances: Array | None
    samples: Array | None
    quantiles: Array | None
    exceedance_probabilities: Array | None
    log_marginal_likelihoods: Array | None
    mean_coefficients: Array | None
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/posterior/batch`."""
        diagnostics = members.diagnostics
        m, d = diagnostics.n_queries, diagnostics.dimension
        mean_coefficients = members.optional_arrays("mean_coefficients")
        return cls(
            means=members.array("means", m),
            variances=members.optional("variances"),
            observation_variances=members.optional("observation_variances"),
            covariance=members.optional("covariance", m),
            gradients=members.optional("gradients", m, d),
            gradient_variances=members.optional("gradient_variances", d),
            samples=members.optional_arrays("samples", m),
            quantiles=members.optional_arrays("quantiles", m),
            exceedance_probabilities=members.optional("exceedance_probabilities", m),
            log_marginal_likelihoods=members.optional("log_marginal_likelihoods"),
            mean_coefficients=mean_coefficients,
            diagnostics=diagnostics,
            fit=batch_fit_used(diagnostics, members.request, mean_coefficients),
        )


@dataclass(frozen=True, eq=False, repr=False)
class AlphaPath(Answer):
    """The criterion over alpha, all else being as it was selected. Without entries if there are `noise_variances`.

    Attributes
    ----------
    alphas
        `[a]`, V², ascending.
    scores
        `[a]`. NaN where the matrix is not positive definite.
    """

    alphas: Array
    scores: Array

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads it from the answer of `/v1/model-selection`."""
        return cls(alphas=members.column("path", "alpha"), scores=members.column("path", "score"))


@dataclass(frozen=True, eq=False, repr=False)
class LeaveOneOut(Answer):
    """What each value is predicted to be from all others, with what was selected.

    Attributes
    ----------
    means
        `[n]`, V. The predictions, in the order of the points.
    variances
        `[n]`, V². Of the values predicted, their noise included.
    log_predictive_densities
        `[n]`. Logarithms of the densities, 1/V, of the values under their predictions.
    """

    means: Array
    variances: Array
    log_predictive_densities: Array

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads it from the answer of `/v1/model-selection`."""
        left_out = members.within("leave_one_out")
        return cls(
            means=left_out.array("means"),
            variances=left_out.array("variances"),
            log_predictive_densities=left_out.array("log_predictive_densities"),
        )


@dataclass(frozen=True, eq=False, repr=False)
class ModelSelection(Answer):
    """The kernel and the noise that explain values best.

    Attributes
    ----------
    kernel
        The kernel that was selected.
    alpha
        V². The variance of the noise that was selected; None with `noise_variances`.
    mean_coefficients
        `[p]`. The mean: the constant, V, then a slope for each coordinate, V/L, if it is linear; None if it is zero.
    score
        The criterion there; greater is better.
    gradient
        A number for each entry of `vary`, in its order: the derivative of the score in the logarithm of what is free;
        for `length_scales` without an axis in that of a factor of all; NaN for `nu`, which takes steps.
    converged
        Whether no slope is left to follow within the bounds.
    evaluations
        How often the criterion was evaluated.
    families
        The families that were tried, each `nu` of `matern` by itself, with their best scores.
    path
        The criterion over alpha: `path.alphas` and `path.scores`.
    leave_one_out
        Each value predicted from all others: `means`, `variances` and `log_predictive_densities`.
    diagnostics
        Of the fit that the search began with.
    fit
        What was selected: `cloud.posterior(values, **answer.fit)` uses it.
    """

    kernel: KernelUsed
    alpha: float | None
    mean_coefficients: Array | None
    score: float
    gradient: Array
    converged: bool
    evaluations: int
    families: tuple[FamilyScore, ...]
    path: AlphaPath
    leave_one_out: LeaveOneOut
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/model-selection`."""
        fields, diagnostics = members.fields, members.diagnostics
        kernel, alpha = KernelUsed.from_dict(fields["kernel"]), fields.get("alpha")
        return cls(
            kernel=kernel,
            alpha=alpha,
            mean_coefficients=members.optional("mean_coefficients"),
            score=fields["score"],
            gradient=members.array("gradient"),
            converged=fields["converged"],
            evaluations=fields["evaluations"],
            families=tuple(FamilyScore.from_dict(entry) for entry in fields["families"]),
            path=AlphaPath.read(members),
            leave_one_out=LeaveOneOut.read(members),
            diagnostics=diagnostics,
            fit=selected_fit(values_fit_used(diagnostics, members.request), kernel, alpha),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Normals(Answer):
    """Unit normals of the surface at the queries. Deviations are None unless asked for.

    Attributes
    ----------
    normals
        `[m, d]`, of length 1, outward unless asked for otherwise.
    gradient_norms
        `[m]`. |∇u| of the function in `surfaces`: 1/L for `signature`, about 1 for `offset`, 1 for `local`.
    levels
        `[m]`. The signature function: 1 on the surface, usually more inside a closed one.
    surfaces
        m entries. The function whose level surface was used.
    normal_deviations
        `[m]`, radians. Standard deviation of the angle of the normal: 95 % of the angles lie within 1.96 of it; NaN
        where none is known.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All that was fitted with: `**answer.fit` in a call repeats it.
    """

    normals: Array
    gradient_norms: Array
    levels: Array
    surfaces: tuple[SurfaceUsed, ...]
    normal_deviations: Array | None
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: Fit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/normals`."""
        diagnostics = members.diagnostics
        return cls(
            normals=members.array("normals", diagnostics.dimension),
            gradient_norms=members.array("gradient_norms"),
            levels=members.array("levels"),
            surfaces=_surfaces(members),
            normal_deviations=members.optional("normal_deviations"),
            degenerate=members.degenerate,
            diagnostics=diagnostics,
            fit=fit_used(diagnostics, members.request),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Curvatures(Answer):
    """Curvatures of the surface at the queries: with outward normals, a sphere of radius r has +1/r everywhere.

    Deviations are None unless asked for.

    Attributes
    ----------
    principal_curvatures
        `[m, d − 1]`, 1/L, ascending.
    principal_directions
        `[m, d − 1, d]`, of length 1, the largest component positive; any basis where curvatures
        coincide.
    mean_curvatures
        `[m]`, 1/L. The average of the principal curvatures.
    gaussian_curvatures
        `[m]`, 1/L^(d − 1). Their product.
    normals
        `[m, d]`, of length 1.
    gradient_norms
        `[m]`. |∇u| of the function in `surfaces`: 1/L for `signature`, about 1 for `offset`, 1 for `local`.
    levels
        `[m]`. The signature function: 1 on the surface, usually more inside a closed one.
    surfaces
        m entries. The function whose level surface was used.
    normal_deviations
        `[m]`, radians. Standard deviation of the angle of the normal: 95 % of the angles lie within 1.96 of it; NaN
        where none is known.
    principal_curvature_deviations
        `[m, d − 1]`, 1/L. Standard deviations of the principal curvatures.
    mean_curvature_deviations
        `[m]`, 1/L.
    gaussian_curvature_deviations
        `[m]`, 1/L^(d − 1).
    degenerate
        The queries without curvatures, or with doubtful ones.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All that was fitted with: `**answer.fit` in a call repeats it.
    """

    principal_curvatures: Array
    principal_directions: Array
    mean_curvatures: Array
    gaussian_curvatures: Array
    normals: Array
    gradient_norms: Array
    levels: Array
    surfaces: tuple[SurfaceUsed, ...]
    normal_deviations: Array | None
    principal_curvature_deviations: Array | None
    mean_curvature_deviations: Array | None
    gaussian_curvature_deviations: Array | None
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: Fit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/curvatures`."""
        diagnostics = members.diagnostics
        d = diagnostics.dimension
        return cls(
            principal_curvatures=members.array("principal_curvatures", d - 1),
            principal_directions=members.array("principal_directions", d - 1, d),
            mean_curvatures=members.array("mean_curvatures"),
            gaussian_curvatures=members.array("gaussian_curvatures"),
            normals=members.array("normals", d),
            gradient_norms=members.array("gradient_norms"),
            levels=members.array("levels"),
            surfaces=_surfaces(members),
            normal_deviations=members.optional("normal_deviations"),
            principal_curvature_deviations=members.optional("principal_curvature_deviations", d - 1),
            mean_curvature_deviations=members.optional("mean_curvature_deviations"),
            gaussian_curvature_deviations=members.optional("gaussian_curvature_deviations"),
            degenerate=members.degenerate,
            diagnostics=diagnostics,
            fit=fit_used(diagnostics, members.request),
        )


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceGradient(Answer):
    """Surface gradients ∇u − (∇u·ν)ν of the values at the queries.

    Attributes
    ----------
    gradients
        `[m, d]`, V/L, tangent to the surface.
    gradient_deviations
        `[m, d]`, V/L. Standard deviations given the values and, as far as it is known, the surface; with `deviations`.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        Of the fit of the values; `diagnostics.geometry` is about that of the surface.
    fit
        All that was fitted with, surface included: `**answer.fit` in a call repeats it.
    """

    gradients: Array
    gradient_deviations: Array | None
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/surface-gradient`."""
        diagnostics = members.diagnostics
        fit = operator_fit_used(diagnostics, members.request)
        d = diagnostics.dimension
        deviations = members.optional("gradient_deviations", d)
        return cls(members.array("gradients", d), deviations, members.degenerate, diagnostics, fit)


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceGradientMatrix(Answer):
    """The surface gradient as matrices, one per coordinate.

    Attributes
    ----------
    matrices
        `[d, m, n]`, 1/L. `matrices @ values` has the shape `[d, m]`.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        Of the fit of values; `diagnostics.geometry` is about that of the surface.
    fit
        All that was fitted with, surface included: `**answer.fit` in a call repeats it.
    """

    matrices: Array
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/surface-gradient/matrix`."""
        diagnostics = members.diagnostics
        fit = operator_fit_used(diagnostics, members.request)
        return cls(members.arrays("matrices", diagnostics.n_points), members.degenerate, diagnostics, fit)


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceGradientSparseMatrix(Answer):
    """The surface gradient as sparse matrices, one per coordinate.

    Attributes
    ----------
    matrices
        d of `scipy.sparse.csr_matrix`, `[m, n]`, 1/L, with their entries at the same places. `matrices[i] @ values` is
        the component i at the queries. Rows of queries without a normal have no entries.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        Of the fit of the surface: nothing is fitted to values.
    fit
        The surface: `**answer.fit` in a call repeats it.
    """

    matrices: list[csr_matrix]
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/surface-gradient/sparse-matrix`."""
        diagnostics = members.diagnostics
        fit = operator_fit_used(diagnostics, members.request)
        return cls(csr_matrices(members), members.degenerate, diagnostics, fit)


@dataclass(frozen=True, eq=False, repr=False)
class LaplaceBeltrami(Answer):
    """The Laplace–Beltrami operator of the values at the queries: on the unit circle Δ cos θ = −cos θ.

    Attributes
    ----------
    values
        `[m]`, V/L². Δu.
    value_deviations
        `[m]`, V/L². Standard deviations given the values and, as far as it is known, the surface; with `deviations`.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        Of the fit of the values; `diagnostics.geometry` is about that of the surface.
    fit
        All that was fitted with, surface included: `**answer.fit` in a call repeats it.
    """

    values: Array
    value_deviations: Array | None
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/laplace-beltrami`."""
        diagnostics = members.diagnostics
        fit = operator_fit_used(diagnostics, members.request)
        deviations = members.optional("value_deviations")
        return cls(members.array("values"), deviations, members.degenerate, diagnostics, fit)


@dataclass(frozen=True, eq=False, repr=False)
class LaplaceBeltramiMatrix(Answer):
    """The Laplace–Beltrami operator as a matrix: on the unit circle `matrix @ cos θ` is −cos θ.

    Attributes
    ----------
    matrix
        `[m, n]`, 1/L². `matrix @ values` is Δu at the queries. Not symmetric in general.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        Of the fit of values; `diagnostics.geometry` is about that of the surface.
    fit
        All that was fitted with, surface included: `**answer.fit` in a call repeats it.
    """

    matrix: Array
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/laplace-beltrami/matrix`."""
        diagnostics = members.diagnostics
        fit = operator_fit_used(diagnostics, members.request)
        return cls(members.array("matrix", diagnostics.n_points), members.degenerate, diagnostics, fit)


@dataclass(frozen=True, eq=False, repr=False)
class LaplaceBeltramiSparseMatrix(Answer):
    """The Laplace–Beltrami operator as a sparse matrix: on the unit circle `matrix @ cos θ` is −cos θ.

    Attributes
    ----------
    matrix
        `scipy.sparse.csr_matrix`, `[m, n]`, 1/L². `matrix @ values` is Δu at the queries. Not symmetric. Rows of
        queries without a normal have no entries.
    degenerate
        The queries without a normal, or with a doubtful one.
    diagnostics
        Of the fit of the surface: nothing is fitted to values.
    fit
        The surface: `**answer.fit` in a call repeats it.
    """

    matrix: csr_matrix
    degenerate: tuple[Degenerate, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/laplace-beltrami/sparse-matrix`."""
        diagnostics = members.diagnostics
        fit = operator_fit_used(diagnostics, members.request)
        [matrix] = csr_matrices(members)
        return cls(matrix, members.degenerate, diagnostics, fit)


def _surfaces(members: Members) -> tuple[SurfaceUsed, ...]:
    return tuple(SurfaceUsed(name) for name in members.fields["surfaces"])
