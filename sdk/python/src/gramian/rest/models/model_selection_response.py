from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.diagnostics import Diagnostics
    from ..models.family_score import FamilyScore
    from ..models.kernel_used import KernelUsed
    from ..models.left_out import LeftOut
    from ..models.path_entry import PathEntry


T = TypeVar("T", bound="ModelSelectionResponse")


@_attrs_define
class ModelSelectionResponse:
    """The selected kernel and noise, with scores and predictions.

    Attributes:
        kernel (KernelUsed): The kernel that was used, with every number. Sent back as `kernel`, it gives the same
            answer.
        score (float): The score of the selection. Greater is better.
        gradient (list[float | None]): Derivatives of the score in the logarithms of the free parameters, in the order
            of `vary`.

            For `length_scales` without an axis, the derivative is in the logarithm of a common factor of all
            length scales. Null for `nu`, which takes steps.
        converged (bool): True if no slope is left to follow within the bounds.
        evaluations (int): Number of evaluations of the score.
        families (list[FamilyScore]): The families that were tried.
        path (list[PathEntry]): The score over ascending alpha, with everything else as selected.

            Empty with `noise_variances`, and for more than 3,000 points.
        leave_one_out (LeftOut): Predictions of each value from all others.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        alpha (float | Unset): The selected variance of the noise. Absent with `noise_variances`.
        mean_coefficients (list[float] | Unset): The mean of the function: the constant, then a slope per coordinate if
            it is linear. Absent if the
            mean is 0.
    """

    kernel: KernelUsed
    score: float
    gradient: list[float | None]
    converged: bool
    evaluations: int
    families: list[FamilyScore]
    path: list[PathEntry]
    leave_one_out: LeftOut
    diagnostics: Diagnostics
    alpha: float | Unset = UNSET
    mean_coefficients: list[float] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        kernel = self.kernel.to_dict()

        score = self.score

        gradient = []
        for gradient_item_data in self.gradient:
            gradient_item: float | None
            gradient_item = gradient_item_data
            gradient.append(gradient_item)

        converged = self.converged

        evaluations = self.evaluations

        families = []
        for families_item_data in self.families:
            families_item = families_item_data.to_dict()
            families.append(families_item)

        path = []
        for path_item_data in self.path:
            path_item = path_item_data.to_dict()
            path.append(path_item)

        leave_one_out = self.leave_one_out.to_dict()

        diagnostics = self.diagnostics.to_dict()

        alpha = self.alpha

        mean_coefficients: list[float] | Unset = UNSET
        if not isinstance(self.mean_coefficients, Unset):
            mean_coefficients = self.mean_coefficients

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "kernel": kernel,
                "score": score,
                "gradient": gradient,
                "converged": converged,
                "evaluations": evaluations,
                "families": families,
                "path": path,
                "leave_one_out": leave_one_out,
                "diagnostics": diagnostics,
            }
        )
        if alpha is not UNSET:
            field_dict["alpha"] = alpha
        if mean_coefficients is not UNSET:
            field_dict["mean_coefficients"] = mean_coefficients

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.diagnostics import Diagnostics
        from ..models.family_score import FamilyScore
        from ..models.kernel_used import KernelUsed
        from ..models.left_out import LeftOut
        from ..models.path_entry import PathEntry

        d = dict(src_dict)
        kernel = KernelUsed.from_dict(d.pop("kernel"))

        score = d.pop("score")

        gradient = []
        _gradient = d.pop("gradient")
        for gradient_item_data in _gradient:

            def _parse_gradient_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            gradient_item = _parse_gradient_item(gradient_item_data)

            gradient.append(gradient_item)

        converged = d.pop("converged")

        evaluations = d.pop("evaluations")

        families = []
        _families = d.pop("families")
        for families_item_data in _families:
            families_item = FamilyScore.from_dict(families_item_data)

            families.append(families_item)

        path = []
        _path = d.pop("path")
        for path_item_data in _path:
            path_item = PathEntry.from_dict(path_item_data)

            path.append(path_item)

        leave_one_out = LeftOut.from_dict(d.pop("leave_one_out"))

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        alpha = d.pop("alpha", UNSET)

        mean_coefficients = cast(list[float], d.pop("mean_coefficients", UNSET))

        model_selection_response = cls(
            kernel=kernel,
            score=score,
            gradient=gradient,
            converged=converged,
            evaluations=evaluations,
            families=families,
            path=path,
            leave_one_out=leave_one_out,
            diagnostics=diagnostics,
            alpha=alpha,
            mean_coefficients=mean_coefficients,
        )

        model_selection_response.additional_properties = d
        return model_selection_response

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
