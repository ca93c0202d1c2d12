"""Arguments of callers: for every field of every method, all accepted forms, and refusals by name."""

from __future__ import annotations

import array
import dataclasses
import enum
import inspect
from collections import ChainMap
from decimal import Decimal
from fractions import Fraction
from types import MappingProxyType
from typing import Any, SupportsFloat

import numpy as np
import numpy.typing as npt
import pytest
from sent import BATCHES, CIRCLE, LISTS, METHODS, OPERATORS, QUERYING, SURFACES, VALUES, client, cloud, posted, sent

import gramian
from gramian import Kernel, KernelFamily, SolverChoice, SolverUsed, Surface
from gramian.rest import models
from gramian.rest.types import UNSET

every_method = pytest.mark.parametrize("method", METHODS)
every_operator = pytest.mark.parametrize("method", OPERATORS)
every_surface = pytest.mark.parametrize("method", SURFACES)


class Foreign:
    """An array of another library."""

    def __init__(self, numbers: object) -> None:
        self.numbers = np.asarray(numbers)

    def __array__(self, dtype: object = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        return self.numbers


class Broken:
    """An array of another library that refuses to be converted."""

    def __array__(self, dtype: object = None, copy: bool | None = None) -> npt.NDArray[Any]:
        raise RuntimeError("detach it first")


# Numbers

HALVES = [
    0.5,
    np.float16(0.5),
    np.float32(0.5),
    np.float64(0.5),
    np.longdouble(0.5),
    np.array(0.5),
    np.array(0.5, dtype=np.float32),
    np.ma.array(0.5),
    Fraction(1, 2),
    Decimal("0.5"),
    Foreign(0.5),
]
TWOS = [
    2,
    2.0,
    np.int64(2),
    np.uint8(2),
    np.float32(2),
    np.array(2),
    np.array(2.0),
    Fraction(2),
    Decimal(2),
    Foreign(2),
]


@every_method
@pytest.mark.parametrize("half", HALVES, ids=repr)
def test_numbers_of_all_kinds_are_numbers(method: str, half: object) -> None:
    body = sent(method, alpha=half, kernel={"family": "matern", "length_scale": half, "variance": half, "nu": half})
    assert body["alpha"] == 0.5
    assert body["kernel"] == {"family": "matern", "length_scale": 0.5, "variance": 0.5, "nu": 0.5}
    kernel = Kernel("laplace", epsilon=half)  # type: ignore[arg-type]
    assert sent(method, kernel=kernel)["kernel"] == {"family": "laplace", "epsilon": 0.5}


@every_operator
@pytest.mark.parametrize("half", HALVES, ids=repr)
def test_so_they_are_in_a_geometry(method: str, half: SupportsFloat) -> None:
    kernel = Kernel("gauss", length_scale=half)
    body = sent(method, surface=Surface(alpha=half, kernel=kernel))
    assert body["surface"] == {"alpha": 0.5, "kernel": {"family": "gauss", "length_scale": 0.5}}
    assert body == sent(method, surface={"alpha": half, "kernel": kernel})


@every_method
@pytest.mark.parametrize("two", TWOS, ids=repr)
def test_whole_numbers_of_all_kinds_are_whole_numbers(method: str, two: object) -> None:
    smoothness = sent(method, kernel={"family": "wendland", "smoothness": two})["kernel"]["smoothness"]
    assert (smoothness, type(smoothness)) == (2, int)
    derivatives = sent("interpolate", derivatives=two)["derivatives"]
    assert (derivatives, type(derivatives)) == (2, int)


def test_numbers_widen_exactly() -> None:
    third = np.float32(1 / 3)
    assert sent("normals", alpha=third)["alpha"] == float(third)
    assert sent("interpolate", values=np.full(8, third))["values"] == [float(third)] * 8
    assert sent("interpolate", values=np.full(8, np.float16(0.1)))["values"] == [float(np.float16(0.1))] * 8
    assert sent("normals", alpha=np.longdouble("0.1"))["alpha"] == 0.1  # rounded as a literal is
    assert sent("normals", alpha=10**20)["alpha"] == 1e20


@every_method
@pytest.mark.parametrize(
    ("alpha", "kind", "message"),
    [
        (float("nan"), ValueError, "alpha is nan"),
        (np.float32("inf"), ValueError, "alpha is inf"),
        (Decimal("-Infinity"), ValueError, "alpha is -Infinity"),
        (Decimal("sNaN"), ValueError, "alpha is no finite number"),
        (10**400, ValueError, "alpha is no finite number"),
        (np.ma.masked, ValueError, "alpha is masked"),
        (np.ma.array(1.0, mask=True), ValueError, "alpha is masked"),
        (2**53 + 1, ValueError, "alpha is 9007199254740993, which float64 has not exactly"),
        (np.int64(2**53 + 1), ValueError, "alpha is 9007199254740993, which float64 has not exactly"),
        (Fraction(1, 3), ValueError, r"alpha is Fraction\(1, 3\), which float64 has not exactly; float\(…\) rounds it"),
        (Decimal("0.1"), ValueError, r"alpha is Decimal\('0.1'\), which float64 has not exactly"),
        (True, TypeError, "alpha is to be a number, not True"),
        (np.bool_(True), TypeError, "alpha is to be a number, not (np.)?True_?"),
        (1j, TypeError, "alpha is to be a number, not 1j"),
        (np.complex128(1), TypeError, "alpha is to be a number, not (np.complex128)?\\("),
        ("0.5", TypeError, "alpha is to be a number, not '0.5'"),
        ([0.5], TypeError, "alpha is to be a number, not of the type list"),
        (np.array([0.5]), TypeError, r"alpha is to be a number, not an array of the shape \[1\]"),
        ({}, TypeError, "alpha is to be a number, not of the type dict"),
    ],
    ids=repr,
)
def test_other_things_than_numbers_are_refused_by_name(
    method: str, alpha: object, kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=rf"^{message}"):
        getattr(cloud(), method)(**METHODS[method], alpha=alpha)
    for parameter in ["length_scale", "variance", "epsilon", "nu"]:
        nested = message.replace("alpha", f"kernel.{parameter}")
        with pytest.raises(kind, match=rf"^{nested}"):
            getattr(cloud(), method)(**METHODS[method], kernel={"family": "gauss", parameter: alpha})
        with pytest.raises(kind, match=rf"^{nested}"):
            Kernel("gauss", **{parameter: alpha})  # type: ignore[arg-type]
    if method in OPERATORS:
        nested = message.replace("alpha", "surface.alpha")
        with pytest.raises(kind, match=rf"^{nested}"):
            getattr(cloud(), method)(**METHODS[method], surface=Surface(alpha=alpha))  # type: ignore[arg-type]
        nested = message.replace("alpha", "surface.kernel.nu")
        with pytest.raises(kind, match=rf"^{nested}"):
            getattr(cloud(), method)(**METHODS[method], surface={"kernel": {"family": "matern", "nu": alpha}})


def test_a_fraction_is_no_whole_number() -> None:
    with pytest.raises(ValueError, match=r"^derivatives is to be a whole number, not 1.5$"):
        sent("interpolate", derivatives=1.5)
    with pytest.raises(ValueError, match=r"^kernel.smoothness is to be a whole number, not 2.5$"):
        Kernel("wendland", smoothness=2.5)  # type: ignore[arg-type]


# Arrays

LAYOUTS: dict[str, Any] = {
    "list": [0.0, 1, 2, 3, 4, 5, 6, 7],
    "tuple": (0, 1, 2, 3, 4, 5, 6, 7),
    "range": range(8),
    "list of numbers of NumPy": [np.float32(i) for i in range(8)],
    "list of arrays without axes": [np.array(i) for i in range(8)],
    **{dtype: np.arange(8).astype(dtype) for dtype in ["f2", "f4", "f8", "g", ">f8", ">i4", "i1", "u1", "i8", "u8"]},
    "strided": np.arange(0, 8, 0.5)[::2],
    "reversed": np.arange(8.0)[::-1][::-1],
    "read-only": np.frombuffer(np.arange(8.0).tobytes()),
    "nothing masked": np.ma.array(VALUES, mask=False),
    "buffer": array.array("d", range(8)),
    "memoryview": memoryview(array.array("f", range(8))),
    "another library": Foreign(np.arange(8)),
}


@pytest.mark.parametrize("values", LAYOUTS.values(), ids=LAYOUTS.keys())
@every_method
def test_arrays_of_all_kinds_are_arrays(method: str, values: npt.ArrayLike) -> None:
    assert sent(method, noise_variances=values)["noise_variances"] == VALUES.tolist()
    if method in BATCHES:
        assert sent(method, values=[values, values])["values"] == [VALUES.tolist()] * 2
    elif "values" in METHODS[method]:
        assert sent(method, values=values)["values"] == VALUES.tolist()
    if method in OPERATORS:
        body = sent(method, surface=Surface(noise_variances=values))
        assert body["surface"] == {"noise_variances": VALUES.tolist()}


ROWS: dict[str, Any] = {
    "lists": CIRCLE.tolist(),
    "tuples": tuple(map(tuple, CIRCLE)),
    "list of arrays": list(CIRCLE),
    "list of masked arrays": [np.ma.array(row) for row in CIRCLE],
    "columns first": np.asfortranarray(CIRCLE),
    "transposed": CIRCLE.T.copy().T,
    "big-endian": CIRCLE.astype(">f8"),
    "matrix": np.ma.array(CIRCLE),
    "memoryview": CIRCLE.data,
    "another library": Foreign(CIRCLE),
}


@pytest.mark.parametrize("rows", ROWS.values(), ids=ROWS.keys())
def test_rows_of_all_kinds_are_points(rows: object) -> None:
    assert posted(rows, rows) == {"points": CIRCLE.tolist(), "normals": CIRCLE.tolist()}
    for method in QUERYING:
        assert sent(method, queries=rows)["queries"] == CIRCLE.tolist()


def test_data_frames_are_arrays() -> None:
    # Columns of one type become an array of that type, columns of several types an array of objects.
    table = np.column_stack([CIRCLE, VALUES]).astype(object)
    table[:, 2] = list("abcdefgh")
    assert posted(Foreign(CIRCLE)) == {"points": CIRCLE.tolist()}
    with pytest.raises(
        ValueError, match=r"^values must have the shape \[n\] = \[8\], not \[8, 1\]; np.ravel\(values\)"
    ):
        sent("interpolate", values=Foreign(VALUES[:, None]))
    with pytest.raises(TypeError, match=r"^points\[0, 2\] is 'a' \(str\), and only numbers can be sent"):
        posted(Foreign(table))
    with pytest.raises(ValueError, match=r"^points\[5, 1\] is nan"):
        posted(Foreign(with_entry(np.nan)))


def with_entry(entry: object, dtype: npt.DTypeLike | None = None) -> npt.NDArray[Any]:
    numbers: npt.NDArray[Any] = CIRCLE.astype(dtype or type(entry))
    numbers[5, 1] = entry
    return numbers


BAD_ROWS: dict[str, tuple[Any, type[Exception], str]] = {
    "nan": (with_entry(np.nan), ValueError, r"{}\[5, 1\] is nan, and only finite numbers can be sent$"),
    "nan in a list": (with_entry(np.nan).tolist(), ValueError, r"{}\[5, 1\] is nan"),
    "nan in float32": (with_entry(np.nan, "f4"), ValueError, r"{}\[5, 1\] is nan"),
    "infinity": (with_entry(np.inf), ValueError, r"{}\[5, 1\] is inf"),
    "-infinity": (with_entry(-np.inf), ValueError, r"{}\[5, 1\] is -inf"),
    "too long": (with_entry(np.longdouble("1e400"), "g"), ValueError, r"{}\[5, 1\] is inf"),
    "masked": (np.ma.masked_equal(with_entry(7.0), 7.0), ValueError, r"{}\[5, 1\] is masked"),
    "masked row": (list(np.ma.masked_equal(with_entry(7.0), 7.0)), ValueError, r"{}\[5, 1\] is masked"),
    "complex": (CIRCLE + 0j, TypeError, r"{0} has complex numbers \(complex128\); send {0}.real and {0}.imag"),
    "complex list": ([[1, 2j]] * 8, TypeError, r"{0} has complex numbers"),
    "truth": (CIRCLE > 0, TypeError, r"{0} has truth values \(bool\); {0}.astype\(float\) makes 0 and 1"),
    "text": (CIRCLE.astype(str), TypeError, r"{} has text"),
    "text list": ([["1", "2"]] * 8, TypeError, r"{} has text"),
    "bytes": (CIRCLE.astype("S8"), TypeError, r"{} has bytes"),
    "dates": (np.zeros((8, 2), dtype="M8[s]"), TypeError, r"{} has dates"),
    "fields": (np.zeros(8, dtype="f8,f8"), TypeError, r"{} has no plain numbers .*structured_to_unstructured"),
    "objects": (CIRCLE.astype(object), TypeError, r"{0} is an array of Python objects; np.asarray\({0}, dtype=float\)"),
    "decimals": ([[Decimal(1), Decimal(2)]] * 8, TypeError, r"{0} is an array of Python objects; np.asarray\({0}, "),
    "nothing": (with_entry(None, object), TypeError, r"{}\[5, 1\] is None \(NoneType\), and only numbers can be sent"),
    "an object": (with_entry("a", object), TypeError, r"{}\[5, 1\] is 'a' \(str\)"),
    "big": (with_entry(2**53 + 1, "i8"), ValueError, r"{}\[5, 1\] is 9007199254740993, which float64 does not have"),
    "negative": (with_entry(-(2**53) - 1, "i8"), ValueError, r"{}\[5, 1\] is -9007199254740993"),
    "biggest": (with_entry(2**63 - 1, "i8"), ValueError, r"{}\[5, 1\] is 9223372036854775807"),
    "unsigned": (np.full((8, 2), 2**64 - 1, "u8"), ValueError, r"{}\[0, 0\] is 18446744073709551615"),
    "ragged": (
        [[1, 2], [3], [4, 5]],
        ValueError,
        r"{0} cannot be read.*: {0}\[0\] has the length 2, {0}\[1\] the length 1",
    ),
    "masked entry": ([*CIRCLE[:5], np.ma.array([1, 2], mask=[False, True])], ValueError, r"{}\[5, 1\] is masked"),
    "masked alone": (np.ma.masked, ValueError, r"{} is masked, and nothing can be sent for it"),
    "too large": ([[1.0, 10**400]] * 8, TypeError, r"{} is an array of Python objects; "),
    "broken": (Broken(), ValueError, r"{} cannot be read as an array: detach it first$"),
    "nested": ([[1, 2], 3], ValueError, r"{} cannot be read as an array: "),
    "dictionary": ({"x": [1]}, TypeError, r"{} is to be an array, not a dict; list\(…\)"),
    "iterator": (zip([1], [2], strict=True), TypeError, r"{} is to be an array, not a zip; list\(…\)"),
    "set": ({1.0}, TypeError, r"{} is to be an array, not a set"),
    "object": (object(), TypeError, r"{} is to be an array of numbers, not of the type object"),
    "string": ("points.csv", TypeError, r"{} has text"),
    "number": (1.0, ValueError, r"{} must have the shape"),
    "empty": ([], ValueError, r"{} must have the shape .*, not \[0\]: it is empty"),
    "no rows": (np.zeros((0, 2)), ValueError, r"{} must have the shape .*, not \[0, 2\]: it is empty"),
    "one axis": (np.zeros(3), ValueError, r"{0} must have the shape .* not \[3\]: rows are [a-z]+; np.reshape\({0}, "),
    "three axes": (np.zeros((8, 2, 1)), ValueError, r"{} must have the shape .* not \[8, 2, 1\]"),
}


@pytest.mark.parametrize(("rows", "kind", "message"), BAD_ROWS.values(), ids=BAD_ROWS.keys())
def test_other_things_than_rows_of_numbers_are_refused_by_name(
    rows: object, kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match="^" + message.format("points")):
        posted(rows)
    if not hasattr(rows, "__next__"):
        with pytest.raises(kind, match="^" + message.format("normals")):
            posted(CIRCLE, rows)
        for method in QUERYING:
            with pytest.raises(kind, match="^" + message.format("queries")):
                sent(method, queries=rows)


@pytest.mark.parametrize("exact", [2**53, -(2**53), 2**60, -(2**63), 3 * 2**55])
def test_integers_that_float64_has_are_sent(exact: int) -> None:
    assert posted(np.array([[exact]]))["points"] == [[float(exact)]]
    if exact > 0:
        assert posted(np.array([[2 * exact]], dtype="u8"))["points"] == [[2.0 * exact]]


@every_method
def test_values_are_refused_by_name_and_place(method: str) -> None:
    bad = VALUES.copy()
    bad[3] = np.nan
    message = r"\[3\] is nan, and only finite numbers can be sent$"
    if method in BATCHES:
        with pytest.raises(ValueError, match=r"^values\[1, 3\] is nan, and only finite numbers can be sent$"):
            sent(method, values=[VALUES, bad])
    elif "values" in METHODS[method]:
        with pytest.raises(ValueError, match=rf"^values{message}"):
            sent(method, values=bad)
    if "values" in METHODS[method]:
        with pytest.raises(TypeError, match=r"^values is missing$"):
            sent(method, values=None)
    with pytest.raises(ValueError, match=rf"^noise_variances{message}"):
        sent(method, noise_variances=bad)
    if method in OPERATORS:
        with pytest.raises(ValueError, match=rf"^surface.noise_variances{message}"):
            sent(method, surface={"noise_variances": bad})


# Shapes


@every_method
@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ((7,), r"must have the shape \[n\] = \[8\], not \[7\]: one number for each point of the cloud$"),
        ((8, 1), r"must have the shape \[n\] = \[8\], not \[8, 1\]; np.ravel\(.*\) is flat$"),
        ((1, 8), r"must have the shape \[n\] = \[8\], not \[1, 8\]; np.ravel\(.*\) is flat$"),
        ((8, 2), r"must have the shape \[n\] = \[8\], not \[8, 2\]$"),
        ((), r"must have the shape \[n\] = \[8\], not \[\]: one number for each point of the cloud"),
        ((0,), r"must have the shape \[n\] = \[8\], not \[0\]: it is empty$"),
    ],
)
def test_there_is_one_value_for_each_point(method: str, shape: tuple[int, ...], message: str) -> None:
    with pytest.raises(ValueError, match=rf"^noise_variances {message}"):
        sent(method, noise_variances=np.ones(shape))
    if "values" in METHODS[method] and method not in BATCHES:
        with pytest.raises(ValueError, match=rf"^values {message}"):
            sent(method, values=np.ones(shape))


@pytest.mark.parametrize("method", BATCHES)
@pytest.mark.parametrize(
    ("values", "message"),
    [
        (VALUES, r"not \[8\]: rows are lists of values; np.reshape\(values, \(1, -1\)\) is one of 8$"),
        (LISTS.T, r"not \[8, 3\]: rows are lists of values; it looks transposed, send values.T$"),
        (LISTS[:, 1:], r"not \[3, 7\]: rows are lists of values$"),
        (LISTS[None], r"not \[1, 3, 8\]: rows are lists of values$"),
        (LISTS[:0], r"not \[0, 8\]: it is empty$"),
        (1.0, r"not \[\]: rows are lists of values$"),
    ],
)
def test_the_rows_of_a_batch_are_lists_of_values(method: str, values: npt.ArrayLike, message: str) -> None:
    with pytest.raises(ValueError, match=rf"^values must have the shape \[k, n\] = \[k, 8\], {message}"):
        sent(method, values=values)


@pytest.mark.parametrize("rows", [LISTS.tolist(), list(LISTS), np.asfortranarray(LISTS), Foreign(LISTS), LISTS.data])
def test_rows_of_all_kinds_are_lists_of_values(rows: object) -> None:
    for method in BATCHES:
        assert sent(method, values=rows)["values"] == LISTS.tolist()


@pytest.mark.parametrize("method", QUERYING)
def test_queries_have_the_dimension_of_the_cloud(method: str) -> None:
    with pytest.raises(
        ValueError, match=r"^queries must have the shape \[m, d\] = \[m, 2\], not \[1, 3\]: rows are points$"
    ):
        sent(method, queries=[[1, 2, 3]])
    with pytest.raises(ValueError, match=r"not \[2, 5\]: rows are points; it looks transposed, send queries.T$"):
        sent(method, queries=np.ones((2, 5)))
    with pytest.raises(
        ValueError, match=r"not \[2\]: rows are points; np.reshape\(queries, \(1, -1\)\) is one of 2 coord"
    ):
        sent(method, queries=[1, 0])


@every_method
def test_one_noise_for_all_points_is_alpha(method: str) -> None:
    with pytest.raises(ValueError, match=r"one number for each point of the cloud; one for all of them is alpha$"):
        sent(method, noise_variances=0.1)


def test_quantiles_are_not_one_for_each_point() -> None:
    with pytest.raises(ValueError, match=r"^quantiles must have the shape \[quantiles\], not \[\]$"):
        sent("posterior", quantiles=0.5)


def test_a_cloud_on_a_line_says_how_to_write_its_queries() -> None:
    line = cloud()
    line.description.dimension = 1
    with pytest.raises(ValueError, match=r"\[3\]: rows are points; np.reshape\(queries, \(-1, 1\)\) are 3 on a line$"):
        line.normals([0, 1, 2])


def test_normals_have_the_shape_of_the_points() -> None:
    message = (
        r"^normals must have the shape \[n, d\] = \[8, 2\], not \[2, 8\]: rows are normals; it looks transposed, send"
    )
    with pytest.raises(ValueError, match=message):
        posted(CIRCLE, CIRCLE.T)
    with pytest.raises(ValueError, match=r"^normals must have the shape \[n, d\] = \[8, 2\], not \[7, 2\]: rows are"):
        posted(CIRCLE, CIRCLE[1:])


# Words

SOLVERS = ["dense", np.str_("dense"), np.array("dense"), SolverChoice.DENSE, SolverUsed.DENSE]
QUANTITIES = [
    "variances",
    gramian.PosteriorQuantity.VARIANCES,
    np.array("variances"),
    ["variances"],
    ("variances",),
    {"variances"},
    {"variances": 1}.keys(),
    iter(["variances"]),
    np.array(["variances"]),
    [gramian.PosteriorQuantity.VARIANCES],
]


class Spelling(enum.Enum):
    """An enumeration of the caller."""

    MERGE = "merge"


@every_method
def test_words_may_be_strings_or_members_of_enumerations(method: str) -> None:
    for solver in SOLVERS:
        assert sent(method, solver=solver)["solver"] == "dense"
    for merge in ["merge", gramian.DuplicatePolicy.MERGE, Spelling.MERGE]:
        assert sent(method, duplicates=merge)["duplicates"] == "merge"
    if method in ["normals", "curvatures"]:
        for surface in ["offset", gramian.SurfaceModelChoice.OFFSET, gramian.SurfaceModelUsed.OFFSET]:
            assert sent(method, surface_model=surface)["surface_model"] == "offset"
        for orientation in ["gradient", gramian.OrientationChoice.GRADIENT]:
            assert sent(method, orientation=orientation)["orientation"] == "gradient"


@pytest.mark.parametrize("method", ["normals", "curvatures", "interpolate", "interpolate_batch"])
def test_deviations_may_be_asked_for_by_their_own_name(method: str) -> None:
    wanted = {"include": ["std"]}
    said: list[dict[str, Any]] = [
        {"std": True},
        {"std": np.True_},
        {"std": True, "include": []},
        {"std": True, "include": "std"},
        {"include": "std"},
        {"include": [gramian.GeometryAttribute.STD], "std": False},
    ]
    for arguments in said:
        assert sent(method, **arguments) == sent(method) | wanted
    for absent in [None, UNSET, False]:
        assert sent(method, std=absent, include=UNSET) == sent(method)
    for number in [1, 0.0, "yes", [True]]:
        with pytest.raises(TypeError, match=r"^std is to be True or False, not "):
            sent(method, std=number)
    with pytest.raises(ValueError, match=r"^include is 'stds', .*; did you mean 'std'\?$"):
        sent(method, include="stds")
    with pytest.raises(TypeError, match=rf"^{method}\(\) has no parameter 'stds'; did you mean 'std'\?$"):
        sent(method, stds=True)


@pytest.mark.parametrize("include", QUANTITIES, ids=repr)
def test_one_word_may_stand_for_a_list(include: object) -> None:
    assert sent("posterior", include=include)["include"] == ["variances"]


def test_several_words_keep_their_order() -> None:
    for method in ["posterior", "posterior_batch"]:
        assert sent(method, include=("gradients", "variances"))["include"] == ["gradients", "variances"]


@every_method
@pytest.mark.parametrize(
    ("solver", "kind", "message"),
    [
        ("desne", ValueError, "solver is 'desne', which is none of 'auto', 'dense', .*; did you mean 'dense'\\?$"),
        ("Dense", ValueError, "solver is 'Dense', .*; did you mean 'dense'\\?$"),
        ("xyz", ValueError, "solver is 'xyz', which is none of 'auto', [^?]*$"),
        (1, TypeError, "solver is to be one of 'auto', .*, not of the type int$"),
        (b"dense", TypeError, "solver is to be one of 'auto', .*, not b'dense'$"),
        (["dense"], TypeError, "solver is to be one of 'auto', .*, not of the type list$"),
    ],
    ids=repr,
)
def test_other_words_are_refused_with_the_nearest(
    method: str, solver: object, kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=rf"^{message}"):
        sent(method, solver=solver)
    if method in OPERATORS:
        with pytest.raises(kind, match=rf"^surface.{message}"):
            sent(method, surface={"solver": solver})


def test_misspelt_words_of_other_fields_name_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"^include is 'variancs', .*; did you mean 'variances'\?$"):
        sent("posterior", include="variancs")
    with pytest.raises(ValueError, match=r"^include\[1\] is 'covarianc', .*; did you mean 'covariance'\?$"):
        sent("posterior", include=["variances", "covarianc"])
    with pytest.raises(TypeError, match=r"^include\[0\] is to be one of .*, not of the type int$"):
        sent("posterior", include=[1])
    with pytest.raises(TypeError, match=r"^include is to be one of .*, not of the type dict$"):
        sent("posterior", include={"variances": True})
    with pytest.raises(ValueError, match=r"^orientation is 'outwards', .*; did you mean 'outward'\?$"):
        sent("normals", orientation="outwards")


# Kernels

GAUSS = {"family": "gauss", "length_scale": 2.0}
OF_AXES = {"family": "gauss", "length_scales": [1.0, 2.0]}
KERNELS: dict[str, tuple[Any, dict[str, Any]]] = {
    "word": ("gauss", {"family": "gauss"}),
    "word with underscore": ("inverse_multiquadric", {"family": "inverse_multiquadric"}),
    "member": (KernelFamily.WENDLAND, {"family": "wendland"}),
    "word of NumPy": (np.array("gauss"), {"family": "gauss"}),
    "dictionary": (GAUSS, GAUSS),
    "dictionary with None": ({**GAUSS, "variance": None, "nu": UNSET}, GAUSS),
    "mapping": (MappingProxyType(GAUSS), GAUSS),
    "other mapping": (ChainMap({"length_scale": np.int64(2)}, {"family": KernelFamily.GAUSS}), GAUSS),
    "kernel": (Kernel(family="gauss", length_scale=2), GAUSS),
    "kernel with a member": (Kernel(KernelFamily.GAUSS, length_scale=2), GAUSS),
    "smooth kernel": (Kernel("wendland", smoothness=np.int8(6)), {"family": "wendland", "smoothness": 6}),
    "generated": (models.Kernel(family=KernelFamily.GAUSS, length_scale=2.0), GAUSS),
    "generated with words": (models.Kernel(family="gauss", length_scale=np.float32(2)), GAUSS),  # type: ignore[arg-type]
    "generated smooth": (
        models.Kernel(family=KernelFamily.WENDLAND, smoothness=gramian.Smoothness.C6),
        {"family": "wendland", "smoothness": 6},
    ),
    "used": (models.KernelUsed.from_dict({**GAUSS, "variance": 3.0}), {**GAUSS, "variance": 3.0}),
    "used by a later service": (
        models.KernelUsed.from_dict({**GAUSS, "variance": 3.0, "turn": [1.0, 2.0]}),
        {**GAUSS, "variance": 3.0, "turn": [1.0, 2.0]},
    ),
    "length scales": (Kernel("gauss", length_scales=(1, 2)), OF_AXES),
    "length scales of NumPy": ({"family": "gauss", "length_scales": np.array([1, 2], dtype="f4")}, OF_AXES),
    "length scales of another library": ({"family": "gauss", "length_scales": Foreign([1, 2])}, OF_AXES),
    "length scales, generated": (models.Kernel(family=KernelFamily.GAUSS, length_scales=[1.0, 2.0]), OF_AXES),
    "length scales, used": (models.KernelUsed.from_dict({**OF_AXES, "variance": 1.0}), {**OF_AXES, "variance": 1.0}),
    "described": (
        models.KernelDescription.from_dict(
            {
                "family": "matern",
                "formula": "",
                "smoothness": "2ν",
                "parameters": [],
                "differentiable_at_points": "",
            }
        ),
        {"family": "matern"},
    ),
}


@pytest.mark.parametrize(("kernel", "expected"), KERNELS.values(), ids=KERNELS.keys())
@every_method
def test_kernels_of_all_kinds_are_kernels(method: str, kernel: object, expected: object) -> None:
    assert sent(method, kernel=kernel)["kernel"] == expected
    if method in OPERATORS:
        assert sent(method, surface={"kernel": kernel})["surface"] == {"kernel": expected}


@pytest.mark.parametrize(
    ("kernel", "kind", "message"),
    [
        ("gaus", ValueError, r"kernel.family is 'gaus', which is none of .*; did you mean 'gauss'\?$"),
        ("Gauss", ValueError, r"kernel.family is 'Gauss', .*; did you mean 'gauss'\?$"),
        ({"length_scale": 2}, TypeError, "kernel.family is missing$"),
        ({}, TypeError, "kernel.family is missing$"),
        ({1: 2}, TypeError, "kernel has no 1, but 'family', "),
        (
            {"family": "gauss", "lenght_scale": 2},
            TypeError,
            r"kernel has no 'lenght_scale', but 'family', 'length_scale', .*; did you mean 'length_scale'\?$",
        ),
        (
            object(),
            TypeError,
            "kernel is to be a family such as 'gauss', a mapping, or a Kernel, not of the type object$",
        ),
        (2.0, TypeError, "kernel is to be a family such as 'gauss', .*, not of the type float$"),
        (["gauss"], TypeError, "kernel is to be a family such as 'gauss', .*, not of the type list$"),
        (
            {"family": "gauss", "length_scales": [1, 2, 3]},
            ValueError,
            r"kernel.length_scales must have the shape \[d\] = \[2\], not \[3\]: one number for each axis$",
        ),
        (
            {"family": "gauss", "length_scales": 2},
            ValueError,
            r"kernel.length_scales must .* not \[\]: one number for each axis; one for all of them is length_scale$",
        ),
        (
            Kernel("gauss", length_scales=[1]),
            ValueError,
            r"kernel.length_scales must have the shape \[d\] = \[2\], not \[1\]: one number for each axis$",
        ),
        (
            {"family": "gauss", "length_scales": [1, np.nan]},
            ValueError,
            r"kernel.length_scales\[1\] is nan, and only finite numbers can be sent$",
        ),
        (
            {"family": "gauss", "length_scales": ["1", "2"]},
            TypeError,
            r"kernel.length_scales has text \(<U1\); only real numbers can be sent$",
        ),
    ],
    ids=repr,
)
@every_method
def test_other_things_than_kernels_are_refused(
    method: str, kernel: object, kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=rf"^{message}"):
        sent(method, kernel=kernel)
    if method in OPERATORS:
        with pytest.raises(kind, match=rf"^surface.{message}"):
            sent(method, surface=Surface(kernel=kernel))  # type: ignore[arg-type]


def test_a_kernel_is_checked_where_it_is_written() -> None:
    with pytest.raises(ValueError, match=r"did you mean 'gauss'\?$"):
        Kernel("gaus")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^Kernel\(\) has no parameter 'lengthscale'; did you mean 'length_scale'\?$"):
        Kernel("gauss", lengthscale=2)  # type: ignore[call-arg]
    assert Kernel("gauss", length_scale=2) == Kernel(KernelFamily.GAUSS, length_scale=np.float32(2))
    assert hash(Kernel("gauss")) == hash(Kernel("gauss", variance=None))
    assert isinstance(Kernel("gauss").family, KernelFamily)


def test_length_scales_are_part_of_what_a_kernel_is() -> None:
    scales = np.array([1.0, 2.0])
    kernel = Kernel("gauss", length_scales=scales)
    scales[:] = 7
    assert kernel.length_scales == (1.0, 2.0)
    assert kernel == Kernel("gauss", length_scales=range(1, 3)) != Kernel("gauss", length_scales=[2, 1])
    assert hash(kernel) == hash(Kernel("gauss", length_scales=np.array([1, 2], dtype="f4")))
    assert Kernel("gauss", length_scales=UNSET) == Kernel("gauss")
    with pytest.raises(dataclasses.FrozenInstanceError):
        kernel.length_scales = None  # type: ignore[misc]
    with pytest.raises(ValueError, match=r"^kernel.length_scales must have the shape \[d\], not \[1, 2\]; np.ravel\("):
        Kernel("gauss", length_scales=[[1, 2]])
    with pytest.raises(ValueError, match=r"^kernel.length_scales\[0\] is inf"):
        Kernel("gauss", length_scales=[np.inf, 1])
    with pytest.raises(
        TypeError, match=r"^Kernel\(\) has no parameter 'lengthscales'; did you mean 'length_scales'\?$"
    ):
        Kernel("gauss", lengthscales=[1, 2])  # type: ignore[call-arg]


# Free parameters

FREE = [{"parameter": "length_scales", "min": 0.1, "max": 10.0}, {"parameter": "alpha", "min": 1e-6, "max": 1.0}]
OF_ONE_AXIS = {"parameter": "length_scales", "axis": 1, "min": 0.1, "max": 10.0}
VARIED: dict[str, tuple[Any, list[dict[str, Any]]]] = {
    "dictionary": ({"length_scales": (0.1, 10), "alpha": (1e-6, 1)}, FREE),
    "dictionary with None": ({"length_scales": [0.1, 10], "nu": None, "alpha": (1e-6, 1), "variance": UNSET}, FREE),
    "members": (
        {gramian.SelectionParameter.LENGTH_SCALES: np.array([0.1, 10]), gramian.SelectionParameter.ALPHA: (1e-6, 1)},
        FREE,
    ),
    "other mapping": (MappingProxyType({"length_scales": Foreign([0.1, 10]), "alpha": (1e-6, np.float64(1))}), FREE),
    "another order": ({"alpha": (1e-6, 1), "length_scales": (0.1, 10)}, FREE[::-1]),
    "list": (FREE, FREE),
    "tuple with an axis": (({**OF_ONE_AXIS, "axis": np.int64(1)}, {**FREE[1], "axis": None}), [OF_ONE_AXIS, FREE[1]]),
    "iterator": (iter([{**FREE[0], "max": Fraction(10)}]), FREE[:1]),
    "generated": (
        [
            models.FreeParameter(parameter=gramian.SelectionParameter.LENGTH_SCALES, min_=0.1, max_=10.0, axis=1),
            gramian.FreeParameter(parameter=gramian.SelectionParameter.ALPHA, min_=1e-6, max_=1.0),
        ],
        [OF_ONE_AXIS, FREE[1]],
    ),
    "nothing": ([], []),
    "nothing by name": ({}, []),
}


@pytest.mark.parametrize(("vary", "expected"), VARIED.values(), ids=VARIED.keys())
def test_what_is_free_may_be_a_dictionary_or_a_list(vary: object, expected: object) -> None:
    assert sent("select_model", vary=vary)["vary"] == expected


@pytest.mark.parametrize(
    ("vary", "kind", "message"),
    [
        (
            {"lenght_scales": (1, 2)},
            TypeError,
            r"vary has no 'lenght_scales', but .*'length_scales'.*; did you mean 'length_scales'\?$",
        ),
        (
            {"alpha": 1},
            ValueError,
            r"vary.alpha must have the shape \[bounds\] = \[2\], not \[\]: the least and the greatest$",
        ),
        ({"alpha": (1, 2, 3)}, ValueError, r"vary.alpha must .* not \[3\]: the least and the greatest$"),
        ({"alpha": (1, np.inf)}, ValueError, r"vary.alpha\[1\] is inf, and only finite numbers can be sent$"),
        ({"alpha": ("1", "2")}, TypeError, r"vary.alpha has text"),
        (
            "alpha",
            TypeError,
            r"vary is to be a mapping such as {'alpha': \(1e-6, 1\)}, or a list, not of the type str$",
        ),
        (0.5, TypeError, r"vary is to be a mapping such as .*, not of the type float$"),
        (["alpha"], TypeError, r"vary\[0\] is to be a mapping such as {'parameter': .*}, not of the type str$"),
        ([FREE[0], {"parameter": "alpha", "min": 1}], TypeError, r"vary\[1\].max is missing$"),
        ([{"min": 1, "max": 2}], TypeError, r"vary\[0\].parameter is missing$"),
        ([{**FREE[0], "parameter": "scale"}], ValueError, r"vary\[0\].parameter is 'scale', which is none of "),
        ([{**FREE[0], "axis": 0.5}], ValueError, r"vary\[0\].axis is to be a whole number, not 0.5$"),
        ([{**FREE[0], "min": np.nan}], ValueError, r"vary\[0\].min is nan, and only finite numbers can be sent$"),
        ([{**FREE[0], "least": 1}], TypeError, r"vary\[0\] has no 'least', but 'parameter', 'axis', 'min', 'max'"),
    ],
    ids=repr,
)
def test_other_things_than_bounds_are_refused_by_name(vary: object, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=rf"^{message}"):
        sent("select_model", vary=vary)


def test_a_selection_takes_words_and_whole_numbers() -> None:
    body = sent("select_model", criterion=gramian.SelectionCriterion.LEAVE_ONE_OUT, restarts=np.int8(5), seed=7.0)
    assert (body["criterion"], body["restarts"], body["seed"]) == ("leave_one_out", 5, 7)
    for families in ["gauss", KernelFamily.GAUSS, ["gauss"], np.array(["gauss"])]:
        assert sent("select_model", families=families)["families"] == ["gauss"]
    assert sent("select_model", families=("matern", "gauss"))["families"] == ["matern", "gauss"]
    with pytest.raises(ValueError, match=r"^criterion is 'leave_one', .*; did you mean 'leave_one_out'\?$"):
        sent("select_model", criterion="leave_one")
    with pytest.raises(ValueError, match=r"^families\[1\] is 'gaus', .*; did you mean 'gauss'\?$"):
        sent("select_model", families=["matern", "gaus"])
    with pytest.raises(ValueError, match=r"^restarts is to be a whole number, not 0.5$"):
        sent("select_model", restarts=0.5)
    with pytest.raises(TypeError, match=r"^select_model\(\) has no parameter 'queries'"):
        sent("select_model", queries=CIRCLE)


# Geometries


@every_operator
def test_a_geometry_may_be_of_another_cloud(method: str) -> None:
    other = cloud()
    other.description.cloud_id = "cd" * 32
    other.description.n_points = 5
    reference = models.CloudInput(id=other.id)
    for geometry in [
        Surface(cloud=other),
        Surface(cloud=other.id),
        {"cloud": other},
        {"cloud": other.description},
        {"cloud": {"id": other.id}},
        models.Surface(cloud=reference),
        other,
        other.id,
    ]:
        assert sent(method, surface=geometry)["surface"] == {"cloud": {"id": other.id}}
    noise = sent(method, surface=Surface(cloud=other, noise_variances=range(5)))["surface"]["noise_variances"]
    assert noise == [0, 1, 2, 3, 4]
    with pytest.raises(ValueError, match=r"^surface.noise_variances must have the shape \[n\] = \[5\], not \[8\]"):
        sent(method, surface=Surface(cloud=other, noise_variances=VALUES))
    assert sent(method, surface=Surface(cloud=other.id, noise_variances=[1]))["surface"]["noise_variances"] == [1]
    with pytest.raises(TypeError, match=r"^surface.cloud is to be a Cloud, as .* returns, not of the type ndarray$"):
        sent(method, surface={"cloud": CIRCLE})
    with pytest.raises(ValueError, match=r"^surface.cloud is 'gauss', and ids of clouds are 64 hexadecimal digits$"):
        sent(method, surface="gauss")
    with pytest.raises(TypeError, match=r"^surface has no 'kernal', but 'kernel', .*; did you mean 'kernel'\?$"):
        sent(method, surface={"kernal": "gauss"})
    with pytest.raises(TypeError, match=r"^Surface\(\) has no parameter 'kernal'; did you mean 'kernel'\?$"):
        Surface(kernal="gauss")  # type: ignore[call-arg]


# Hyperparameters


@every_surface
def test_hyperparameters_are_sent_as_they_were_reported(method: str) -> None:
    learned = {"noise_deviation": 0.01, "of_a_later_version": [1, {"two": None}]}
    assert sent(method, hyperparameters=learned)["hyperparameters"] == learned
    assert sent(method, hyperparameters=MappingProxyType(learned))["hyperparameters"] == learned
    model = models.SampleOptions(count=3, seed=1)  # any model of the service
    assert sent(method, hyperparameters=model)["hyperparameters"] == {"count": 3, "seed": 1}
    with pytest.raises(
        TypeError, match=r"^hyperparameters is to be the diagnostics\.hyperparameters of an answer, not"
    ):
        sent(method, hyperparameters="learned")


@every_method
def test_only_normals_take_sites_and_only_surfaces_hyperparameters(method: str) -> None:
    parameters = inspect.signature(getattr(gramian.Cloud, method)).parameters
    assert ("sites" in parameters) == (method == "normals")
    assert ("hyperparameters" in parameters) == (method in SURFACES)


# Absence


@every_method
@pytest.mark.parametrize("absent", [None, UNSET], ids=repr)
def test_none_is_as_absent_everywhere(method: str, absent: object) -> None:
    names = ["kernel", "noise_variances", "solver", "duplicates"]
    names += ["queries"] if method in QUERYING else []
    names += {
        "interpolate": ["derivatives"],
        "interpolate_batch": ["derivatives", "std", "mean"],
        "posterior": ["include"],
        "posterior_batch": ["include", "samples", "quantiles", "threshold", "mean"],
        "select_model": ["criterion", "vary", "families", "restarts", "seed", "mean"],
        "normals": ["surface_model", "orientation"],
    }.get(method, [])
    names += ["surface"] if method in OPERATORS else []
    names += ["hyperparameters"] if method in SURFACES else []
    assert sent(method, **dict.fromkeys(names, absent), alpha=None) == sent(method)
    if method in OPERATORS:
        nothing = {
            "cloud": absent,
            "kernel": absent,
            "noise_variances": absent,
            "solver": absent,
            "model": absent,
        }
        assert sent(method, surface=nothing)["surface"] == {}


@every_method
def test_an_alpha_that_diagnostics_lack_is_not_replaced_by_another(method: str) -> None:
    with pytest.raises(ValueError, match=r"^alpha is absent from these diagnostics, of a fit with noise_variances"):
        sent(method, kernel="gauss", alpha=UNSET)
    assert "alpha" not in sent(method, alpha=UNSET, noise_variances=VALUES)


# Keywords


@every_method
@pytest.mark.parametrize(
    ("misspelt", "meant"), [("kernal", "kernel"), ("Alpha", "alpha"), ("noise_variance", "noise_variances")]
)
def test_a_misspelt_keyword_names_the_nearest(method: str, misspelt: str, meant: str) -> None:
    with pytest.raises(TypeError, match=rf"^{method}\(\) has no parameter '{misspelt}'; did you mean '{meant}'\?$"):
        sent(method, **{misspelt: 1})
    with pytest.raises(TypeError, match=rf"^{method}\(\) has no parameter 'xyz'$"):
        sent(method, xyz=1)


@every_method
def test_a_parameter_of_the_kernel_is_said_to_be_one(method: str) -> None:
    with pytest.raises(TypeError, match=rf"^{method}\(\) has no parameter 'length_scale'; it is one of a Kernel$"):
        sent(method, kernel="gauss", length_scale=2)
    with pytest.raises(TypeError, match=r"^kernel has no 'gauss', but 'family', 'length_scale', "):
        sent(method, kernel={"gauss": 2})


def test_so_it_does_for_the_client() -> None:
    with pytest.raises(TypeError, match=r"^Client\(\) has no parameter 'url'; did you mean 'base_url'\?$"):
        gramian.Client(url="http://localhost")  # type: ignore[call-arg]
    with pytest.raises(TypeError, match=r"^cloud\(\) has no parameter 'normal'; did you mean 'normals'\?$"):
        client().cloud(CIRCLE, normal=CIRCLE)


@every_method
def test_every_parameter_of_a_fit_is_in_signature_and_docstring(method: str) -> None:
    function = getattr(gramian.Cloud, method)
    parameters = inspect.signature(function).parameters
    documented = inspect.getdoc(function)
    assert documented is not None
    section = documented.partition("Parameters\n----------\n")[2].partition("\n\nExamples\n--------\n")[0]
    for name in ["kernel", "alpha", "noise_variances", "solver", "duplicates"]:
        assert parameters[name].kind is inspect.Parameter.KEYWORD_ONLY
        assert parameters[name].default is None
    assert not any(parameter.kind is inspect.Parameter.VAR_KEYWORD for parameter in parameters.values())
    section, _, returned = section.partition("\n\nReturns\n-------\n")
    assert returned.startswith(inspect.signature(function).return_annotation + "\n")
    names = [line.partition(" : ")[0] for line in section.splitlines() if not line.startswith(" ")]
    assert names == [name for name in parameters if name != "self"]
