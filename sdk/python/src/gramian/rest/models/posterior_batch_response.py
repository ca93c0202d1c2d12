from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="PosteriorBatchResponse")


@_attrs_define
class PosteriorBatchResponse:
    """The Gaussian processes given the values.

    Each list has its own rows in everything that depends on its values. The lists share the rest.

        Attributes:
            means (list[list[float]]): The posterior mean at each query, a row per list.
            diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
            variances (list[float] | Unset): The variance of the latent functions at each query.
            observation_variances (list[float] | Unset): The variance of a new observation at each query.
            covariance (list[list[float]] | Unset): The covariance of the latent functions between queries.
            gradients (list[list[list[float]]] | Unset): The gradient of the mean at each query, for each list.
            gradient_variances (list[list[float]] | Unset): The variances of the components of the latent functions'
                gradients at each query.
            samples (list[list[list[float]]] | Unset): Draws of the latent function for each list. A draw is a row, with a
                number per query.
            quantiles (list[list[list[float]]] | Unset): Quantiles of the latent function for each list. A probability is a
                row, with a number per query.
            exceedance_probabilities (list[list[float]] | Unset): The probability that a new observation exceeds `threshold`
                at each query, a row per list.
            log_marginal_likelihoods (list[float] | Unset): The log marginal likelihood of each list, −½YᵀΛ − ½ ln det(K +
                αI) − ½n ln 2π.
            mean_coefficients (list[list[float]] | Unset): The mean of each function, a row per list. Absent if the mean is
                0.

                A row is the constant, followed by a slope per coordinate if the mean is linear.
    """

    means: list[list[float]]
    diagnostics: Diagnostics
    variances: list[float] | Unset = UNSET
    observation_variances: list[float] | Unset = UNSET
    covariance: list[list[float]] | Unset = UNSET
    gradients: list[list[list[float]]] | Unset = UNSET
    gradient_variances: list[list[float]] | Unset = UNSET
    samples: list[list[list[float]]] | Unset = UNSET
    quantiles: list[list[list[float]]] | Unset = UNSET
    exceedance_probabilities: list[list[float]] | Unset = UNSET
    log_marginal_likelihoods: list[float] | Unset = UNSET
    mean_coefficients: list[list[float]] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        means = []
        for means_item_data in self.means:
            means_item = means_item_data

            means.append(means_item)

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

        gradients: list[list[list[float]]] | Unset = UNSET
        if not isinstance(self.gradients, Unset):
            gradients = []
            for gradients_item_data in self.gradients:
                gradients_item = []
                for gradients_item_item_data in gradients_item_data:
                    gradients_item_item = gradients_item_item_data

                    gradients_item.append(gradients_item_item)

                gradients.append(gradients_item)

        gradient_variances: list[list[float]] | Unset = UNSET
        if not isinstance(self.gradient_variances, Unset):
            gradient_variances = []
            for gradient_variances_item_data in self.gradient_variances:
                gradient_variances_item = gradient_variances_item_data

                gradient_variances.append(gradient_variances_item)

        samples: list[list[list[float]]] | Unset = UNSET
        if not isinstance(self.samples, Unset):
            samples = []
            for samples_item_data in self.samples:
                samples_item = []
                for samples_item_item_data in samples_item_data:
                    samples_item_item = samples_item_item_data

                    samples_item.append(samples_item_item)

                samples.append(samples_item)

        quantiles: list[list[list[float]]] | Unset = UNSET
        if not isinstance(self.quantiles, Unset):
            quantiles = []
            for quantiles_item_data in self.quantiles:
                quantiles_item = []
                for quantiles_item_item_data in quantiles_item_data:
                    quantiles_item_item = quantiles_item_item_data

                    quantiles_item.append(quantiles_item_item)

                quantiles.append(quantiles_item)

        exceedance_probabilities: list[list[float]] | Unset = UNSET
        if not isinstance(self.exceedance_probabilities, Unset):
            exceedance_probabilities = []
            for exceedance_probabilities_item_data in self.exceedance_probabilities:
                exceedance_probabilities_item = exceedance_probabilities_item_data

                exceedance_probabilities.append(exceedance_probabilities_item)

        log_marginal_likelihoods: list[float] | Unset = UNSET
        if not isinstance(self.log_marginal_likelihoods, Unset):
            log_marginal_likelihoods = self.log_marginal_likelihoods

        mean_coefficients: list[list[float]] | Unset = UNSET
        if not isinstance(self.mean_coefficients, Unset):
            mean_coefficients = []
            for mean_coefficients_item_data in self.mean_coefficients:
                mean_coefficients_item = mean_coefficients_item_data

                mean_coefficients.append(mean_coefficients_item)

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
        if log_marginal_likelihoods is not UNSET:
            field_dict["log_marginal_likelihoods"] = log_marginal_likelihoods
        if mean_coefficients is not UNSET:
            field_dict["mean_coefficients"] = mean_coefficients

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        means = []
        _means = d.pop("means")
        for means_item_data in _means:
            means_item = cast(list[float], means_item_data)

            means.append(means_item)

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
        gradients: list[list[list[float]]] | Unset = UNSET
        if _gradients is not UNSET:
            gradients = []
            for gradients_item_data in _gradients:
                gradients_item = []
                _gradients_item = gradients_item_data
                for gradients_item_item_data in _gradients_item:
                    gradients_item_item = cast(list[float], gradients_item_item_data)

                    gradients_item.append(gradients_item_item)

                gradients.append(gradients_item)

        _gradient_variances = d.pop("gradient_variances", UNSET)
        gradient_variances: list[list[float]] | Unset = UNSET
        if _gradient_variances is not UNSET:
            gradient_variances = []
            for gradient_variances_item_data in _gradient_variances:
                gradient_variances_item = cast(list[float], gradient_variances_item_data)

                gradient_variances.append(gradient_variances_item)

        _samples = d.pop("samples", UNSET)
        samples: list[list[list[float]]] | Unset = UNSET
        if _samples is not UNSET:
            samples = []
            for samples_item_data in _samples:
                samples_item = []
                _samples_item = samples_item_data
                for samples_item_item_data in _samples_item:
                    samples_item_item = cast(list[float], samples_item_item_data)

                    samples_item.append(samples_item_item)

                samples.append(samples_item)

        _quantiles = d.pop("quantiles", UNSET)
        quantiles: list[list[list[float]]] | Unset = UNSET
        if _quantiles is not UNSET:
            quantiles = []
            for quantiles_item_data in _quantiles:
                quantiles_item = []
                _quantiles_item = quantiles_item_data
                for quantiles_item_item_data in _quantiles_item:
                    quantiles_item_item = cast(list[float], quantiles_item_item_data)

                    quantiles_item.append(quantiles_item_item)

                quantiles.append(quantiles_item)

        _exceedance_probabilities = d.pop("exceedance_probabilities", UNSET)
        exceedance_probabilities: list[list[float]] | Unset = UNSET
        if _exceedance_probabilities is not UNSET:
            exceedance_probabilities = []
            for exceedance_probabilities_item_data in _exceedance_probabilities:
                exceedance_probabilities_item = cast(list[float], exceedance_probabilities_item_data)

                exceedance_probabilities.append(exceedance_probabilities_item)

        log_marginal_likelihoods = cast(list[float], d.pop("log_marginal_likelihoods", UNSET))

        _mean_coefficients = d.pop("mean_coefficients", UNSET)
        mean_coefficients: list[list[float]] | Unset = UNSET
        if _mean_coefficients is not UNSET:
            mean_coefficients = []
            for mean_coefficients_item_data in _mean_coefficients:
                mean_coefficients_item = cast(list[float], mean_coefficients_item_data)

                mean_coefficients.append(mean_coefficients_item)

        posterior_batch_response = cls(
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
            log_marginal_likelihoods=log_marginal_likelihoods,
            mean_coefficients=mean_coefficients,
        )

        posterior_batch_response.additional_properties = d
        return posterior_batch_response

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
