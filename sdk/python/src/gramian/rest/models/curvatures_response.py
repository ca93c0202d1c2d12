from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.surface_used import SurfaceUsed
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.degenerate import Degenerate
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="CurvaturesResponse")


@_attrs_define
class CurvaturesResponse:
    """Curvatures of the surface at the queries.

    Attributes:
        principal_curvatures (list[list[float] | None]): The d − 1 principal curvatures at each query, ascending,
            1/length. Null where there is none.
        principal_directions (list[list[list[float]] | None]): A unit direction for each principal curvature, its
            largest component positive.

            Where curvatures coincide, their directions are an arbitrary basis.
        mean_curvatures (list[float | None]): The average of the principal curvatures at each query, 1/length. Null
            where there are none.
        gaussian_curvatures (list[float | None]): The product of the principal curvatures at each query, 1/length to the
            d − 1. Null where there are
            none.
        normals (list[list[float] | None]): The normal at each query, of length 1. Null where there is none.
        gradient_norms (list[float]): |∇u| at each query for the function in `surfaces`: unit 1/length for `signature`,
            about 1 for
            `offset`.
        levels (list[float]): The signature function at each query: 1 on the surface, usually more inside a closed one.
        surfaces (list[SurfaceUsed]): The function whose level surface was used at each query. It is `signature` where
            there is no
            answer.
        degenerate (list[Degenerate]): The queries where geometry has no meaning (null), or less accuracy than it seems.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        normal_deviations (list[float | None] | Unset): Standard deviation of the angle of the normal at each query,
            radians.

            95 % of the angles lie within 1.96 standard deviations. Null where there is no answer or the
            deviation is not known.
        principal_curvature_deviations (list[list[float] | None] | Unset): Standard deviations of the principal
            curvatures at each query, in their order, 1/length.
        mean_curvature_deviations (list[float | None] | Unset): Standard deviations of the mean curvatures, 1/length.
        gaussian_curvature_deviations (list[float | None] | Unset): Standard deviations of the Gaussian curvatures,
            1/length to the d − 1.
    """

    principal_curvatures: list[list[float] | None]
    principal_directions: list[list[list[float]] | None]
    mean_curvatures: list[float | None]
    gaussian_curvatures: list[float | None]
    normals: list[list[float] | None]
    gradient_norms: list[float]
    levels: list[float]
    surfaces: list[SurfaceUsed]
    degenerate: list[Degenerate]
    diagnostics: Diagnostics
    normal_deviations: list[float | None] | Unset = UNSET
    principal_curvature_deviations: list[list[float] | None] | Unset = UNSET
    mean_curvature_deviations: list[float | None] | Unset = UNSET
    gaussian_curvature_deviations: list[float | None] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        principal_curvatures = []
        for principal_curvatures_item_data in self.principal_curvatures:
            principal_curvatures_item: list[float] | None
            if isinstance(principal_curvatures_item_data, list):
                principal_curvatures_item = principal_curvatures_item_data

            else:
                principal_curvatures_item = principal_curvatures_item_data
            principal_curvatures.append(principal_curvatures_item)

        principal_directions = []
        for principal_directions_item_data in self.principal_directions:
            principal_directions_item: list[list[float]] | None
            if isinstance(principal_directions_item_data, list):
                principal_directions_item = []
                for principal_directions_item_type_0_item_data in principal_directions_item_data:
                    principal_directions_item_type_0_item = principal_directions_item_type_0_item_data

                    principal_directions_item.append(principal_directions_item_type_0_item)

            else:
                principal_directions_item = principal_directions_item_data
            principal_directions.append(principal_directions_item)

        mean_curvatures = []
        for mean_curvatures_item_data in self.mean_curvatures:
            mean_curvatures_item: float | None
            mean_curvatures_item = mean_curvatures_item_data
            mean_curvatures.append(mean_curvatures_item)

        gaussian_curvatures = []
        for gaussian_curvatures_item_data in self.gaussian_curvatures:
            gaussian_curvatures_item: float | None
            gaussian_curvatures_item = gaussian_curvatures_item_data
            gaussian_curvatures.append(gaussian_curvatures_item)

        normals = []
        for normals_item_data in self.normals:
            normals_item: list[float] | None
            if isinstance(normals_item_data, list):
                normals_item = normals_item_data

            else:
                normals_item = normals_item_data
            normals.append(normals_item)

        gradient_norms = self.gradient_norms

        levels = self.levels

        surfaces = []
        for surfaces_item_data in self.surfaces:
            surfaces_item = surfaces_item_data.value
            surfaces.append(surfaces_item)

        degenerate = []
        for degenerate_item_data in self.degenerate:
            degenerate_item = degenerate_item_data.to_dict()
            degenerate.append(degenerate_item)

        diagnostics = self.diagnostics.to_dict()

        normal_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.normal_deviations, Unset):
            normal_deviations = []
            for normal_deviations_item_data in self.normal_deviations:
                normal_deviations_item: float | None
                normal_deviations_item = normal_deviations_item_data
                normal_deviations.append(normal_deviations_item)

        principal_curvature_deviations: list[list[float] | None] | Unset = UNSET
        if not isinstance(self.principal_curvature_deviations, Unset):
            principal_curvature_deviations = []
            for principal_curvature_deviations_item_data in self.principal_curvature_deviations:
                principal_curvature_deviations_item: list[float] | None
                if isinstance(principal_curvature_deviations_item_data, list):
                    principal_curvature_deviations_item = principal_curvature_deviations_item_data

                else:
                    principal_curvature_deviations_item = principal_curvature_deviations_item_data
                principal_curvature_deviations.append(principal_curvature_deviations_item)

        mean_curvature_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.mean_curvature_deviations, Unset):
            mean_curvature_deviations = []
            for mean_curvature_deviations_item_data in self.mean_curvature_deviations:
                mean_curvature_deviations_item: float | None
                mean_curvature_deviations_item = mean_curvature_deviations_item_data
                mean_curvature_deviations.append(mean_curvature_deviations_item)

        gaussian_curvature_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.gaussian_curvature_deviations, Unset):
            gaussian_curvature_deviations = []
            for gaussian_curvature_deviations_item_data in self.gaussian_curvature_deviations:
                gaussian_curvature_deviations_item: float | None
                gaussian_curvature_deviations_item = gaussian_curvature_deviations_item_data
                gaussian_curvature_deviations.append(gaussian_curvature_deviations_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "principal_curvatures": principal_curvatures,
                "principal_directions": principal_directions,
                "mean_curvatures": mean_curvatures,
                "gaussian_curvatures": gaussian_curvatures,
                "normals": normals,
                "gradient_norms": gradient_norms,
                "levels": levels,
                "surfaces": surfaces,
                "degenerate": degenerate,
                "diagnostics": diagnostics,
            }
        )
        if normal_deviations is not UNSET:
            field_dict["normal_deviations"] = normal_deviations
        if principal_curvature_deviations is not UNSET:
            field_dict["principal_curvature_deviations"] = principal_curvature_deviations
        if mean_curvature_deviations is not UNSET:
            field_dict["mean_curvature_deviations"] = mean_curvature_deviations
        if gaussian_curvature_deviations is not UNSET:
            field_dict["gaussian_curvature_deviations"] = gaussian_curvature_deviations

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.degenerate import Degenerate
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        principal_curvatures = []
        _principal_curvatures = d.pop("principal_curvatures")
        for principal_curvatures_item_data in _principal_curvatures:

            def _parse_principal_curvatures_item(data: object) -> list[float] | None:
                if data is None:
                    return data
                try:
                    if not isinstance(data, list):
                        raise TypeError()
                    principal_curvatures_item_type_0 = cast(list[float], data)

                    return principal_curvatures_item_type_0
                except (TypeError, ValueError, AttributeError, KeyError):
                    pass
                return cast(list[float] | None, data)

            principal_curvatures_item = _parse_principal_curvatures_item(principal_curvatures_item_data)

            principal_curvatures.append(principal_curvatures_item)

        principal_directions = []
        _principal_directions = d.pop("principal_directions")
        for principal_directions_item_data in _principal_directions:

            def _parse_principal_directions_item(data: object) -> list[list[float]] | None:
                if data is None:
                    return data
                try:
                    if not isinstance(data, list):
                        raise TypeError()
                    principal_directions_item_type_0 = []
                    _principal_directions_item_type_0 = data
                    for principal_directions_item_type_0_item_data in _principal_directions_item_type_0:
                        principal_directions_item_type_0_item = cast(
                            list[float], principal_directions_item_type_0_item_data
                        )

                        principal_directions_item_type_0.append(principal_directions_item_type_0_item)

                    return principal_directions_item_type_0
                except (TypeError, ValueError, AttributeError, KeyError):
                    pass
                return cast(list[list[float]] | None, data)

            principal_directions_item = _parse_principal_directions_item(principal_directions_item_data)

            principal_directions.append(principal_directions_item)

        mean_curvatures = []
        _mean_curvatures = d.pop("mean_curvatures")
        for mean_curvatures_item_data in _mean_curvatures:

            def _parse_mean_curvatures_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            mean_curvatures_item = _parse_mean_curvatures_item(mean_curvatures_item_data)

            mean_curvatures.append(mean_curvatures_item)

        gaussian_curvatures = []
        _gaussian_curvatures = d.pop("gaussian_curvatures")
        for gaussian_curvatures_item_data in _gaussian_curvatures:

            def _parse_gaussian_curvatures_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            gaussian_curvatures_item = _parse_gaussian_curvatures_item(gaussian_curvatures_item_data)

            gaussian_curvatures.append(gaussian_curvatures_item)

        normals = []
        _normals = d.pop("normals")
        for normals_item_data in _normals:

            def _parse_normals_item(data: object) -> list[float] | None:
                if data is None:
                    return data
                try:
                    if not isinstance(data, list):
                        raise TypeError()
                    normals_item_type_0 = cast(list[float], data)

                    return normals_item_type_0
                except (TypeError, ValueError, AttributeError, KeyError):
                    pass
                return cast(list[float] | None, data)

            normals_item = _parse_normals_item(normals_item_data)

            normals.append(normals_item)

        gradient_norms = cast(list[float], d.pop("gradient_norms"))

        levels = cast(list[float], d.pop("levels"))

        surfaces = []
        _surfaces = d.pop("surfaces")
        for surfaces_item_data in _surfaces:
            surfaces_item = SurfaceUsed(surfaces_item_data)

            surfaces.append(surfaces_item)

        degenerate = []
        _degenerate = d.pop("degenerate")
        for degenerate_item_data in _degenerate:
            degenerate_item = Degenerate.from_dict(degenerate_item_data)

            degenerate.append(degenerate_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        _normal_deviations = d.pop("normal_deviations", UNSET)
        normal_deviations: list[float | None] | Unset = UNSET
        if _normal_deviations is not UNSET:
            normal_deviations = []
            for normal_deviations_item_data in _normal_deviations:

                def _parse_normal_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                normal_deviations_item = _parse_normal_deviations_item(normal_deviations_item_data)

                normal_deviations.append(normal_deviations_item)

        _principal_curvature_deviations = d.pop("principal_curvature_deviations", UNSET)
        principal_curvature_deviations: list[list[float] | None] | Unset = UNSET
        if _principal_curvature_deviations is not UNSET:
            principal_curvature_deviations = []
            for principal_curvature_deviations_item_data in _principal_curvature_deviations:

                def _parse_principal_curvature_deviations_item(data: object) -> list[float] | None:
                    if data is None:
                        return data
                    try:
                        if not isinstance(data, list):
                            raise TypeError()
                        principal_curvature_deviations_item_type_0 = cast(list[float], data)

                        return principal_curvature_deviations_item_type_0
                    except (TypeError, ValueError, AttributeError, KeyError):
                        pass
                    return cast(list[float] | None, data)

                principal_curvature_deviations_item = _parse_principal_curvature_deviations_item(
                    principal_curvature_deviations_item_data
                )

                principal_curvature_deviations.append(principal_curvature_deviations_item)

        _mean_curvature_deviations = d.pop("mean_curvature_deviations", UNSET)
        mean_curvature_deviations: list[float | None] | Unset = UNSET
        if _mean_curvature_deviations is not UNSET:
            mean_curvature_deviations = []
            for mean_curvature_deviations_item_data in _mean_curvature_deviations:

                def _parse_mean_curvature_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                mean_curvature_deviations_item = _parse_mean_curvature_deviations_item(
                    mean_curvature_deviations_item_data
                )

                mean_curvature_deviations.append(mean_curvature_deviations_item)

        _gaussian_curvature_deviations = d.pop("gaussian_curvature_deviations", UNSET)
        gaussian_curvature_deviations: list[float | None] | Unset = UNSET
        if _gaussian_curvature_deviations is not UNSET:
            gaussian_curvature_deviations = []
            for gaussian_curvature_deviations_item_data in _gaussian_curvature_deviations:

                def _parse_gaussian_curvature_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                gaussian_curvature_deviations_item = _parse_gaussian_curvature_deviations_item(
                    gaussian_curvature_deviations_item_data
                )

                gaussian_curvature_deviations.append(gaussian_curvature_deviations_item)

        curvatures_response = cls(
            principal_curvatures=principal_curvatures,
            principal_directions=principal_directions,
            mean_curvatures=mean_curvatures,
            gaussian_curvatures=gaussian_curvatures,
            normals=normals,
            gradient_norms=gradient_norms,
            levels=levels,
            surfaces=surfaces,
            degenerate=degenerate,
            diagnostics=diagnostics,
            normal_deviations=normal_deviations,
            principal_curvature_deviations=principal_curvature_deviations,
            mean_curvature_deviations=mean_curvature_deviations,
            gaussian_curvature_deviations=gaussian_curvature_deviations,
        )

        curvatures_response.additional_properties = d
        return curvatures_response

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
