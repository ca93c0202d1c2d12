from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.factorization_used import FactorizationUsed
from ..models.solver_used import SolverUsed
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.kernel_used import KernelUsed
    from ..models.warning import Warning_


T = TypeVar("T", bound="Diagnostics")


@_attrs_define
class Diagnostics:
    """What an answer says of itself: the numbers used, how the system was solved, and how well.

    Attributes:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given.
        n_points (int): Points of the cloud, n.
        n_queries (int): Queries answered, m.
        dimension (int): Coordinates of each point, d.
        kernel (KernelUsed): The kernel that was used, every number of it: sent back as `kernel` it gives the same
            answer.
        solver (SolverUsed): The solver that was used. `landmark`, `iterative` and `local` are reserved: no answer has
            them yet.
        factorization (FactorizationUsed): How the Gram matrix was factorized. `bunch_kaufman`, `partial_pivoting_lu`,
            `conjugate_gradients` and `local` are reserved: no
            answer has them yet.
        rank (int): Numerical rank of the matrix.
        reciprocal_condition (float): Estimate of 1/(‖K + αI‖₁‖(K + αI)⁻¹‖₁): about how many digits survive, as a
            fraction of all.
        relative_residual (float): ‖Y − (K + αI)Λ‖/‖Y‖ of the solve; for matrices and surfaces, with Y = 1.
        native_norm_squared (float): ‖u‖² = ΛᵀKΛ in the native space of the kernel.
        misfit (float): |u(X) − Y|, unit of the values.
        n_merged_duplicates (int): Points that were merged into an earlier one.
        warnings (list[Warning_]): What was changed or limits the accuracy.
        alpha (float | Unset): What was added to the diagonal; absent with `noise_variances`.
        geometry (Diagnostics | Unset): What an answer says of itself: the numbers used, how the system was solved, and
            how well.
    """

    cloud_id: str
    n_points: int
    n_queries: int
    dimension: int
    kernel: KernelUsed
    solver: SolverUsed
    factorization: FactorizationUsed
    rank: int
    reciprocal_condition: float
    relative_residual: float
    native_norm_squared: float
    misfit: float
    n_merged_duplicates: int
    warnings: list[Warning_]
    alpha: float | Unset = UNSET
    geometry: Diagnostics | Unset = UNSET
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

        rank = self.rank

        reciprocal_condition = self.reciprocal_condition

        relative_residual = self.relative_residual

        native_norm_squared = self.native_norm_squared

        misfit = self.misfit

        n_merged_duplicates = self.n_merged_duplicates

        warnings = []
        for warnings_item_data in self.warnings:
            warnings_item = warnings_item_data.to_dict()
            warnings.append(warnings_item)

        alpha = self.alpha

        geometry: dict[str, Any] | Unset = UNSET
        if not isinstance(self.geometry, Unset):
            geometry = self.geometry.to_dict()

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
                "rank": rank,
                "reciprocal_condition": reciprocal_condition,
                "relative_residual": relative_residual,
                "native_norm_squared": native_norm_squared,
                "misfit": misfit,
                "n_merged_duplicates": n_merged_duplicates,
                "warnings": warnings,
            }
        )
        if alpha is not UNSET:
            field_dict["alpha"] = alpha
        if geometry is not UNSET:
            field_dict["geometry"] = geometry

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.kernel_used import KernelUsed
        from ..models.warning import Warning_

        d = dict(src_dict)
        cloud_id = d.pop("cloud_id")

        n_points = d.pop("n_points")

        n_queries = d.pop("n_queries")

        dimension = d.pop("dimension")

        kernel = KernelUsed.from_dict(d.pop("kernel"))

        solver = SolverUsed(d.pop("solver"))

        factorization = FactorizationUsed(d.pop("factorization"))

        rank = d.pop("rank")

        reciprocal_condition = d.pop("reciprocal_condition")

        relative_residual = d.pop("relative_residual")

        native_norm_squared = d.pop("native_norm_squared")

        misfit = d.pop("misfit")

        n_merged_duplicates = d.pop("n_merged_duplicates")

        warnings = []
        _warnings = d.pop("warnings")
        for warnings_item_data in _warnings:
            warnings_item = Warning_.from_dict(warnings_item_data)

            warnings.append(warnings_item)

        alpha = d.pop("alpha", UNSET)

        _geometry = d.pop("geometry", UNSET)
        geometry: Diagnostics | Unset
        if isinstance(_geometry, Unset):
            geometry = UNSET
        else:
            geometry = Diagnostics.from_dict(_geometry)

        diagnostics = cls(
            cloud_id=cloud_id,
            n_points=n_points,
            n_queries=n_queries,
            dimension=dimension,
            kernel=kernel,
            solver=solver,
            factorization=factorization,
            rank=rank,
            reciprocal_condition=reciprocal_condition,
            relative_residual=relative_residual,
            native_norm_squared=native_norm_squared,
            misfit=misfit,
            n_merged_duplicates=n_merged_duplicates,
            warnings=warnings,
            alpha=alpha,
            geometry=geometry,
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
