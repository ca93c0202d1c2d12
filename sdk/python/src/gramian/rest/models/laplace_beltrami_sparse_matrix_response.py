from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.degenerate import Degenerate
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="LaplaceBeltramiSparseMatrixResponse")


@_attrs_define
class LaplaceBeltramiSparseMatrixResponse:
    """The Laplace–Beltrami operator as a sparse matrix with rows for the queries and columns for the nodes.

    Attributes:
        shape (list[int]): The number of queries and the number of nodes.
        indptr (list[int]): The position of the first entry of each row, from 0, and the number of all entries at the
            end.
        indices (list[int]): The column of each entry, from 0, ascending within a row.
        data (list[float]): The entries row by row, 1/length².

            In Python: `scipy.sparse.csr_matrix((data, indices, indptr), shape)`.
        degenerate (list[Degenerate]): The queries where geometry has no meaning (an empty row), or less accuracy than
            it seems.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
    """

    shape: list[int]
    indptr: list[int]
    indices: list[int]
    data: list[float]
    degenerate: list[Degenerate]
    diagnostics: Diagnostics
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        shape = self.shape

        indptr = self.indptr

        indices = self.indices

        data = self.data

        degenerate = []
        for degenerate_item_data in self.degenerate:
            degenerate_item = degenerate_item_data.to_dict()
            degenerate.append(degenerate_item)

        diagnostics = self.diagnostics.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "shape": shape,
                "indptr": indptr,
                "indices": indices,
                "data": data,
                "degenerate": degenerate,
                "diagnostics": diagnostics,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.degenerate import Degenerate
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        shape = cast(list[int], d.pop("shape"))

        indptr = cast(list[int], d.pop("indptr"))

        indices = cast(list[int], d.pop("indices"))

        data = cast(list[float], d.pop("data"))

        degenerate = []
        _degenerate = d.pop("degenerate")
        for degenerate_item_data in _degenerate:
            degenerate_item = Degenerate.from_dict(degenerate_item_data)

            degenerate.append(degenerate_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        laplace_beltrami_sparse_matrix_response = cls(
            shape=shape,
            indptr=indptr,
            indices=indices,
            data=data,
            degenerate=degenerate,
            diagnostics=diagnostics,
        )

        laplace_beltrami_sparse_matrix_response.additional_properties = d
        return laplace_beltrami_sparse_matrix_response

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
