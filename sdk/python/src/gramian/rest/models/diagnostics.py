from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.factorization_used import FactorizationUsed
from ..models.solver_used import SolverUsed
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.hyperparameters import Hyperparameters
    from ..models.kernel_used import KernelUsed
    from ..models.stencil_counts import StencilCounts
    from ..models.warning import Warning_


T = TypeVar("T", bound="Diagnostics")


@_attrs_define
class Diagnostics:
    """Diagnostics of an answer: the numbers used, the method, and its accuracy.

    Attributes:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given.
        n_points (int): Number of points of the cloud, n.
        n_queries (int): Number of queries answered, m.
        dimension (int): Number of coordinates of each point, d.
        kernel (KernelUsed): The kernel that was used, with every number. Sent back as `kernel`, it gives the same
            answer.
        solver (SolverUsed): The solver that was used.
        factorization (FactorizationUsed): The factorization of the Gram matrix.
        n_merged_duplicates (int): Number of points that were merged into an earlier point.
        warnings (list[Warning_]): Changes that were made, and limits of the accuracy.
        alpha (float | Unset): The number added to the diagonal. Absent with `noise_variances`.
        solver_reason (str | Unset): The reason why `auto` chose a solver other than the dense one. Absent otherwise.
        rank (int | Unset): Numerical rank of the matrix, or the number of landmarks.
        remaining_diagonal (float | Unset): Largest entry of the diagonal of K that the landmarks leave, over all
            points. Only with the solver
            `landmark`.
        diagonal_tolerance (float | Unset): Largest entry of the diagonal that the landmarks were allowed to leave, unit
            of the values squared: a
            millionth of the noise or less. Only with the solver `landmark`.
        tolerance (float | Unset): Largest relative residual that was allowed. Only with the solver `iterative`.
        iterations (int | Unset): Number of iterations of conjugate gradients, with the solvers `iterative` and
            `landmark`.
        reciprocal_condition (float | Unset): Estimate of 1/(‖K + αI‖₁‖(K + αI)⁻¹‖₁): roughly the fraction of digits
            that survive. For landmarks,
            that of their normal equations.
        relative_residual (float | Unset): ‖Y − (K + αI)Λ‖/‖Y‖ of the solve, where Y is the values without their mean.
            For matrices and surfaces,
            Y = 1.
        native_norm_squared (float | Unset): ‖u‖² = ΛᵀKΛ, the squared norm in the native space of the kernel.
        mean_coefficients (list[float] | Unset): The mean of the function: the constant, then a slope per coordinate if
            it is linear. Absent if the
            mean is 0.
        misfit (float | Unset): |u(X) − Y|, unit of the values.

            Absent for values from the local solver, which is not evaluated at the points.
        noise_deviation (float | Unset): Estimated standard deviation of the noise of the points across the surface,
            length.
        hyperparameters (Hyperparameters | Unset): What local regressions learned of a cloud.

            Send it back as it came, as `hyperparameters` of a request about a part of the cloud. It is opaque: its
            members may change in any version, and one of another version may be refused.
        reach (int | Unset): Number of positions around a point on which the answer there depends, with local
            regressions.
        stencils (StencilCounts | Unset): Number of rows of a sparse operator by how their weights were computed.
        surface (Diagnostics | Unset): Diagnostics of an answer: the numbers used, the method, and its accuracy.
    """

    cloud_id: str
    n_points: int
    n_queries: int
    dimension: int
    kernel: KernelUsed
    solver: SolverUsed
    factorization: FactorizationUsed
    n_merged_duplicates: int
    warnings: list[Warning_]
    alpha: float | Unset = UNSET
    solver_reason: str | Unset = UNSET
    rank: int | Unset = UNSET
    remaining_diagonal: float | Unset = UNSET
    diagonal_tolerance: float | Unset = UNSET
    tolerance: float | Unset = UNSET
    iterations: int | Unset = UNSET
    reciprocal_condition: float | Unset = UNSET
    relative_residual: float | Unset = UNSET
    native_norm_squared: float | Unset = UNSET
    mean_coefficients: list[float] | Unset = UNSET
    misfit: float | Unset = UNSET
    noise_deviation: float | Unset = UNSET
    hyperparameters: Hyperparameters | Unset = UNSET
    reach: int | Unset = UNSET
    stencils: StencilCounts | Unset = UNSET
    surface: Diagnostics | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        cloud_id = self.cloud_id

        n_points = self.n_points

        n_queries = self.n_queries

        dimension = self.dimension

        kernel = self.kernel.to_dict()

        solver = self.solver.value

        factorization = self.factorization.value

        n_merged_duplicates = self.n_merged_duplicates

        warnings = []
        for warnings_item_data in self.warnings:
            warnings_item = warnings_item_data.to_dict()
            warnings.append(warnings_item)

        alpha = self.alpha

        solver_reason = self.solver_reason

        rank = self.rank

        remaining_diagonal = self.remaining_diagonal

        diagonal_tolerance = self.diagonal_tolerance

        tolerance = self.tolerance

        iterations = self.iterations

        reciprocal_condition = self.reciprocal_condition

        relative_residual = self.relative_residual

        native_norm_squared = self.native_norm_squared

        mean_coefficients: list[float] | Unset = UNSET
        if not isinstance(self.mean_coefficients, Unset):
            mean_coefficients = self.mean_coefficients

        misfit = self.misfit

        noise_deviation = self.noise_deviation

        hyperparameters: dict[str, Any] | Unset = UNSET
        if not isinstance(self.hyperparameters, Unset):
            hyperparameters = self.hyperparameters.to_dict()

        reach = self.reach

        stencils: dict[str, Any] | Unset = UNSET
        if not isinstance(self.stencils, Unset):
            stencils = self.stencils.to_dict()

        surface: dict[str, Any] | Unset = UNSET
        if not isinstance(self.surface, Unset):
            surface = self.surface.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "cloud_id": cloud_id,
                "n_points": n_points,
                "n_queries": n_queries,
                "dimension": dimension,
                "kernel": kernel,
                "solver": solver,
                "factorization": factorization,
                "n_merged_duplicates": n_merged_duplicates,
                "warnings": warnings,
            }
        )
        if alpha is not UNSET:
            field_dict["alpha"] = alpha
        if solver_reason is not UNSET:
            field_dict["solver_reason"] = solver_reason
        if rank is not UNSET:
            field_dict["rank"] = rank
        if remaining_diagonal is not UNSET:
            field_dict["remaining_diagonal"] = remaining_diagonal
        if diagonal_tolerance is not UNSET:
            field_dict["diagonal_tolerance"] = diagonal_tolerance
        if tolerance is not UNSET:
            field_dict["tolerance"] = tolerance
        if iterations is not UNSET:
            field_dict["iterations"] = iterations
        if reciprocal_condition is not UNSET:
            field_dict["reciprocal_condition"] = reciprocal_condition
        if relative_residual is not UNSET:
            field_dict["relative_residual"] = relative_residual
        if native_norm_squared is not UNSET:
            field_dict["native_norm_squared"] = native_norm_squared
        if mean_coefficients is not UNSET:
            field_dict["mean_coefficients"] = mean_coefficients
        if misfit is not UNSET:
            field_dict["misfit"] = misfit
        if noise_deviation is not UNSET:
            field_dict["noise_deviation"] = noise_deviation
        if hyperparameters is not UNSET:
            field_dict["hyperparameters"] = hyperparameters
        if reach is not UNSET:
            field_dict["reach"] = reach
        if stencils is not UNSET:
            field_dict["stencils"] = stencils
        if surface is not UNSET:
            field_dict["surface"] = surface

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.hyperparameters import Hyperparameters
        from ..models.kernel_used import KernelUsed
        from ..models.stencil_counts import StencilCounts
        from ..models.warning import Warning_

        d = dict(src_dict)
        cloud_id = d.pop("cloud_id")

        n_points = d.pop("n_points")

        n_queries = d.pop("n_queries")

        dimension = d.pop("dimension")

        kernel = KernelUsed.from_dict(d.pop("kernel"))

        solver = SolverUsed(d.pop("solver"))

        factorization = FactorizationUsed(d.pop("factorization"))

        n_merged_duplicates = d.pop("n_merged_duplicates")

        warnings = []
        _warnings = d.pop("warnings")
        for warnings_item_data in _warnings:
            warnings_item = Warning_.from_dict(warnings_item_data)

            warnings.append(warnings_item)

        alpha = d.pop("alpha", UNSET)

        solver_reason = d.pop("solver_reason", UNSET)

        rank = d.pop("rank", UNSET)

        remaining_diagonal = d.pop("remaining_diagonal", UNSET)

        diagonal_tolerance = d.pop("diagonal_tolerance", UNSET)

        tolerance = d.pop("tolerance", UNSET)

        iterations = d.pop("iterations", UNSET)

        reciprocal_condition = d.pop("reciprocal_condition", UNSET)

        relative_residual = d.pop("relative_residual", UNSET)

        native_norm_squared = d.pop("native_norm_squared", UNSET)

        mean_coefficients = cast(list[float], d.pop("mean_coefficients", UNSET))

        misfit = d.pop("misfit", UNSET)

        noise_deviation = d.pop("noise_deviation", UNSET)

        _hyperparameters = d.pop("hyperparameters", UNSET)
        hyperparameters: Hyperparameters | Unset
        if isinstance(_hyperparameters, Unset):
            hyperparameters = UNSET
        else:
            hyperparameters = Hyperparameters.from_dict(_hyperparameters)

        reach = d.pop("reach", UNSET)

        _stencils = d.pop("stencils", UNSET)
        stencils: StencilCounts | Unset
        if isinstance(_stencils, Unset):
            stencils = UNSET
        else:
            stencils = StencilCounts.from_dict(_stencils)

        _surface = d.pop("surface", UNSET)
        surface: Diagnostics | Unset
        if isinstance(_surface, Unset):
            surface = UNSET
        else:
            surface = Diagnostics.from_dict(_surface)

        diagnostics = cls(
            cloud_id=cloud_id,
            n_points=n_points,
            n_queries=n_queries,
            dimension=dimension,
            kernel=kernel,
            solver=solver,
            factorization=factorization,
            n_merged_duplicates=n_merged_duplicates,
            warnings=warnings,
            alpha=alpha,
            solver_reason=solver_reason,
            rank=rank,
            remaining_diagonal=remaining_diagonal,
            diagonal_tolerance=diagonal_tolerance,
            tolerance=tolerance,
            iterations=iterations,
            reciprocal_condition=reciprocal_condition,
            relative_residual=relative_residual,
            native_norm_squared=native_norm_squared,
            mean_coefficients=mean_coefficients,
            misfit=misfit,
            noise_deviation=noise_deviation,
            hyperparameters=hyperparameters,
            reach=reach,
            stencils=stencils,
            surface=surface,
        )

        diagnostics.additional_properties = d
        return diagnostics

    @property
    def additional_keys(self) -> list[str]:
        return list(self.additional_properties.keys())

    def __getitem__(self, key: str) -> Any:
        return self.additional_properties[key]

    def __setitem__(self, key: str, value: Any) -> None:
        self.additional_properties[key] = value

    def __delitem__(self, key: str) -> None:
        del self.additional_properties[key]

    def __contains__(self, key: str) -> bool:
        return key in self.additional_properties
