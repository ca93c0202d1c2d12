from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="LeaveOneOutPredictions")


@_attrs_define
class LeaveOneOutPredictions:
    """Predictions of each value from all others. A row that counts once with another has its prediction.

    Attributes:
        means (list[float | None]): The predictions, in the order of the points. Null where the mean is not determined
            without the point.
        variances (list[float | None]): The variances of the predicted values, noise included.
        log_predictive_densities (list[float | None]): The logarithms of the densities of the values under their
            predictions.
    """

    means: list[float | None]
    variances: list[float | None]
    log_predictive_densities: list[float | None]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        means = []
        for means_item_data in self.means:
            means_item: float | None
            means_item = means_item_data
            means.append(means_item)

        variances = []
        for variances_item_data in self.variances:
            variances_item: float | None
            variances_item = variances_item_data
            variances.append(variances_item)

        log_predictive_densities = []
        for log_predictive_densities_item_data in self.log_predictive_densities:
            log_predictive_densities_item: float | None
            log_predictive_densities_item = log_predictive_densities_item_data
            log_predictive_densities.append(log_predictive_densities_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "means": means,
                "variances": variances,
                "log_predictive_densities": log_predictive_densities,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        means = []
        _means = d.pop("means")
        for means_item_data in _means:

            def _parse_means_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            means_item = _parse_means_item(means_item_data)

            means.append(means_item)

        variances = []
        _variances = d.pop("variances")
        for variances_item_data in _variances:

            def _parse_variances_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            variances_item = _parse_variances_item(variances_item_data)

            variances.append(variances_item)

        log_predictive_densities = []
        _log_predictive_densities = d.pop("log_predictive_densities")
        for log_predictive_densities_item_data in _log_predictive_densities:

            def _parse_log_predictive_densities_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            log_predictive_densities_item = _parse_log_predictive_densities_item(log_predictive_densities_item_data)

            log_predictive_densities.append(log_predictive_densities_item)

        leave_one_out_predictions = cls(
            means=means,
            variances=variances,
            log_predictive_densities=log_predictive_densities,
        )

        leave_one_out_predictions.additional_properties = d
        return leave_one_out_predictions

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
