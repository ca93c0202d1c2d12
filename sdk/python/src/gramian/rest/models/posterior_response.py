from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="PosteriorResponse")


@_attrs_define
class PosteriorResponse:
    """The Gaussian process given the values.

    Attributes:
        means (list[float]): The posterior mean at each query, unit of the values.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        variances (list[float] | Unset): The variance of the latent function at each query, no noise added, unit of the
            values squared.
        observation_variances (list[float] | Unset): The variance of a new observation at each query.
        covariance (list[list[float]] | Unset): The covariance of the latent function between queries.
        gradients (list[list[float]] | Unset): The gradient of the mean at each query, unit of the values per length.
        gradient_variances (list[list[float]] | Unset): The variances of the components of the latent function's
            gradient at each query.
        samples (list[list[float]] | Unset): Draws of the latent function. A draw is a row, with a number per query.
        quantiles (list[list[float]] | Unset): Quantiles of the latent function. A probability is a row, with a number
            per query.
        exceedance_probabilities (list[float] | Unset): The probability that a new observation exceeds `threshold`, at
            each query.
        log_marginal_likelihood (float | Unset): The log marginal likelihood of the values, −½YᵀΛ − ½ ln det(K + αI) −
            ½n ln 2π.
    """

    means: list[float]
    diagnostics: Diagnostics
    variances: list[float] | Unset = UNSET
    observation_variances: list[float] | Unset = UNSET
    covariance: list[list[float]] | Unset = UNSET
    gradients: list[list[float]] | Unset = UNSET
    gradient_variances: list[list[float]] | Unset = UNSET
    samples: list[list[float]] | Unset = UNSET
    quantiles: list[list[float]] | Unset = UNSET
    exceedance_probabilities: list[float] | Unset = UNSET
    log_marginal_likelihood: float | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        means = self.means

        diagnostics = self.diagnostics.to_dict()

        variances: list[float] | Unset = UNSET
        if not isinstance(self.variances, Unset):
            variances = self.variances

        observation_variances: list[float] | Unset = UNSET
        if not isinstance(self.observation_variances, Unset):
            observation_variances = self.observation_variances

        covariance: list[list[float]] | Unset = UNSET
        if not isinstance(self.covariance, Unset):
            covariance = []
            for covariance_item_data in self.covariance:
                covariance_item = covariance_item_data

                covariance.append(covariance_item)

        gradients: list[list[float]] | Unset = UNSET
        if not isinstance(self.gradients, Unset):
            gradients = []
            for gradients_item_data in self.gradients:
                gradients_item = gradients_item_data

                gradients.append(gradients_item)

        gradient_variances: list[list[float]] | Unset = UNSET
        if not isinstance(self.gradient_variances, Unset):
            gradient_variances = []
            for gradient_variances_item_data in self.gradient_variances:
                gradient_variances_item = gradient_variances_item_data

                gradient_variances.append(gradient_variances_item)

        samples: list[list[float]] | Unset = UNSET
        if not isinstance(self.samples, Unset):
            samples = []
            for samples_item_data in self.samples:
                samples_item = samples_item_data

                samples.append(samples_item)

        quantiles: list[list[float]] | Unset = UNSET
        if not isinstance(self.quantiles, Unset):
            quantiles = []
            for quantiles_item_data in self.quantiles:
                quantiles_item = quantiles_item_data

                quantiles.append(quantiles_item)

        exceedance_probabilities: list[float] | Unset = UNSET
        if not isinstance(self.exceedance_probabilities, Unset):
            exceedance_probabilities = self.exceedance_probabilities

        log_marginal_likelihood = self.log_marginal_likelihood

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "means": means,
                "diagnostics": diagnostics,
            }
        )
        if variances is not UNSET:
            field_dict["variances"] = variances
        if observation_variances is not UNSET:
            field_dict["observation_variances"] = observation_variances
        if covariance is not UNSET:
            field_dict["covariance"] = covariance
        if gradients is not UNSET:
            field_dict["gradients"] = gradients
        if gradient_variances is not UNSET:
            field_dict["gradient_variances"] = gradient_variances
        if samples is not UNSET:
            field_dict["samples"] = samples
        if quantiles is not UNSET:
            field_dict["quantiles"] = quantiles
        if exceedance_probabilities is not UNSET:
            field_dict["exceedance_probabilities"] = exceedance_probabilities
        if log_marginal_likelihood is not UNSET:
            field_dict["log_marginal_likelihood"] = log_marginal_likelihood

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        means = cast(list[float], d.pop("means"))

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        variances = cast(list[float], d.pop("variances", UNSET))

        observation_variances = cast(list[float], d.pop("observation_variances", UNSET))

        _covariance = d.pop("covariance", UNSET)
        covariance: list[list[float]] | Unset = UNSET
        if _covariance is not UNSET:
            covariance = []
            for covariance_item_data in _covariance:
                covariance_item = cast(list[float], covariance_item_data)

                covariance.append(covariance_item)

        _gradients = d.pop("gradients", UNSET)
        gradients: list[list[float]] | Unset = UNSET
        if _gradients is not UNSET:
            gradients = []
            for gradients_item_data in _gradients:
                gradients_item = cast(list[float], gradients_item_data)

                gradients.append(gradients_item)

        _gradient_variances = d.pop("gradient_variances", UNSET)
        gradient_variances: list[list[float]] | Unset = UNSET
        if _gradient_variances is not UNSET:
            gradient_variances = []
            for gradient_variances_item_data in _gradient_variances:
                gradient_variances_item = cast(list[float], gradient_variances_item_data)

                gradient_variances.append(gradient_variances_item)

        _samples = d.pop("samples", UNSET)
        samples: list[list[float]] | Unset = UNSET
        if _samples is not UNSET:
            samples = []
            for samples_item_data in _samples:
                samples_item = cast(list[float], samples_item_data)

                samples.append(samples_item)

        _quantiles = d.pop("quantiles", UNSET)
        quantiles: list[list[float]] | Unset = UNSET
        if _quantiles is not UNSET:
            quantiles = []
            for quantiles_item_data in _quantiles:
                quantiles_item = cast(list[float], quantiles_item_data)

                quantiles.append(quantiles_item)

        exceedance_probabilities = cast(list[float], d.pop("exceedance_probabilities", UNSET))

        log_marginal_likelihood = d.pop("log_marginal_likelihood", UNSET)

        posterior_response = cls(
            means=means,
            diagnostics=diagnostics,
            variances=variances,
            observation_variances=observation_variances,
            covariance=covariance,
            gradients=gradients,
            gradient_variances=gradient_variances,
            samples=samples,
            quantiles=quantiles,
            exceedance_probabilities=exceedance_probabilities,
            log_marginal_likelihood=log_marginal_likelihood,
        )

        posterior_response.additional_properties = d
        return posterior_response

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
