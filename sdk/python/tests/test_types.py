"""Types of the generated client: no Any, no anonymous inner objects, real enumerations, None for null."""

from __future__ import annotations

import enum
import importlib
import inspect
import json
import pkgutil
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

import attrs
import numpy as np
import pytest

import gramian
from gramian import answers, rest
from gramian.answers.asked import Asked
from gramian.arguments import fit, keywords, options
from gramian.resources import selection
from gramian.rest import api, models
from gramian.rest.types import File, Response, Unset
from gramian.wire.tensors import Array

MODELS = [getattr(models, name) for name in models.__all__]
OBJECTS = [model for model in MODELS if attrs.has(model)]
ENUMERATIONS = [model for model in MODELS if issubclass(model, enum.Enum)]

# Answers may grow: this dictionary keeps members of later versions, whose types are unknown.
LATER_MEMBERS = "additional_properties"

# The modules import their models for type checkers only.
NAMES = {model.__name__: model for model in MODELS} | {"Unset": Unset, "File": File}


def parts(hint: Any) -> Iterator[Any]:
    """Yields a type and all types in it."""
    yield hint
    for part in get_args(hint):
        yield from parts(part)


def fields(model: type) -> dict[str, Any]:
    hints = get_type_hints(model, localns=NAMES)
    return {field.name: hints[field.name] for field in attrs.fields(model) if field.name != LATER_MEMBERS}


def functions() -> Iterator[tuple[str, Any]]:
    for module in pkgutil.walk_packages(api.__path__, api.__name__ + "."):
        if not module.ispkg:
            for name in ["sync", "sync_detailed", "asyncio", "asyncio_detailed"]:
                yield f"{module.name}.{name}", getattr(importlib.import_module(module.name), name, None)


def test_every_model_is_an_object_or_an_enumeration() -> None:
    assert len(OBJECTS) > 25
    assert len(ENUMERATIONS) > 9
    assert len(OBJECTS) + len(ENUMERATIONS) == len(MODELS)


@pytest.mark.parametrize("model", OBJECTS, ids=lambda model: model.__name__)
def test_no_field_is_any(model: type) -> None:
    for name, hint in fields(model).items():
        assert all(part not in (Any, object, dict) for part in parts(hint)), f"{name}: {hint}"


def test_no_argument_or_result_is_any() -> None:
    found = [(name, function) for name, function in functions() if function is not None]
    assert len(found) > 50
    for name, function in found:
        for hint in get_type_hints(function).values():
            assert all(part not in (Any, object, dict) for part in parts(hint)), f"{name}: {hint}"


def test_requests_have_no_later_members() -> None:
    sent = [models.CloudInput, models.Kernel, models.Surface, models.SampleOptions, models.FreeParameter]
    sent += [models.MeshBounds]
    sent += [models.Hyperparameters, models.MeansLevel, models.NoiseRatio]  # as they were answered
    sent += [models.Region, models.RegionAdjacency, models.TileRegions, models.RegionOverlap]
    for model in OBJECTS:
        is_request = model.__name__.endswith("Request") or model in sent
        if model is models.EstimateRequest:  # has the members of whichever request is meant
            continue
        assert (LATER_MEMBERS not in attrs.fields_dict(model)) == is_request, model


def test_every_model_is_a_named_schema() -> None:
    # The generator names anonymous schemas by their place: GeometryType0, KernelListKernelsItem.
    document = json.loads((Path(__file__).parents[3] / "openapi" / "openapi.json").read_text())
    schemas = document["components"]["schemas"]
    named = {name for name, schema in schemas.items() if "properties" in schema or "enum" in schema}
    assert {model.__name__.rstrip("_") for model in MODELS} == named


def test_enumerations_are_enumerations() -> None:
    assert models.KernelFamily("gauss") is models.KernelFamily.GAUSS
    hints = fields(models.CurvaturesResponse) | fields(models.Flag) | fields(models.Diagnostics)
    assert hints["surface_models"] == list[models.SurfaceModelUsed]
    assert hints["reason"] is models.FlagReason
    assert hints["solver"] is models.SolverUsed
    assert hints["factorization"] is models.FactorizationUsed
    assert fields(models.Warning_)["code"] is models.WarningCode
    assert fields(models.PosteriorRequest)["include"] == list[models.PosteriorQuantity] | Unset
    assert fields(models.NormalsRequest)["include"] == list[models.GeometryAttribute] | Unset


def test_nullable_entries_are_nullable_and_nothing_else_is() -> None:
    row = list[float]
    assert fields(models.NormalsResponse)["normals"] == list[row | None]
    curvatures = fields(models.CurvaturesResponse)
    assert curvatures["principal_curvatures"] == list[row | None]
    assert curvatures["principal_directions"] == list[list[row] | None]
    assert curvatures["mean_curvatures"] == list[float | None]
    assert curvatures["gaussian_curvatures"] == list[float | None]
    assert curvatures["principal_curvature_std"] == list[row | None] | Unset
    for of_what in ["normal", "mean_curvature", "gaussian_curvature"]:
        assert curvatures[f"{of_what}_std"] == list[float | None] | Unset
    assert fields(models.SurfaceGradientResponse)["gradients"] == list[row | None]
    assert fields(models.SurfaceGradientMatrixResponse)["matrices"] == list[list[row | None]]
    assert fields(models.LaplaceBeltramiResponse)["laplacians"] == list[float | None]
    assert fields(models.LaplaceBeltramiMatrixResponse)["matrix"] == list[row | None]
    assert fields(models.LaplaceBeltramiSparseMatrixResponse)["indices"] == list[int]
    nullable = {model.__name__ for model in OBJECTS for hint in fields(model).values() if type(None) in parts(hint)}
    # A matrix that is not positive definite has no score. A point on which the mean depends has no
    # prediction.
    others = {"AlphaScore", "FamilyScore", "LeaveOneOutPredictions"}
    assert all(name.endswith("Response") for name in nullable - others)
    assert not nullable & {"InterpolationResponse", "PosteriorResponse", "LaplaceBeltramiSparseMatrixResponse"}


def test_a_required_body_is_required_and_the_key_is_not() -> None:
    from gramian.rest.api.geometry import compute_curvatures

    signature = inspect.signature(compute_curvatures.sync_detailed)
    assert signature.parameters["body"].default is inspect.Parameter.empty
    hints = get_type_hints(compute_curvatures.sync_detailed)
    assert hints["client"] == rest.AuthenticatedClient | rest.Client
    assert hints["return"] == Response[models.CurvaturesResponse | models.Problem]


@pytest.mark.parametrize(
    "alias",
    [
        fit.Family,
        fit.Solver,
        fit.Duplicates,
        fit.SurfaceModel,
        fit.Orientation,
        fit.Mean,
        fit.Quantity,
        fit.Std,
        fit.Of,
        fit.GeometryWord,
        selection.Criterion,
        selection.Parameter,
    ],
    ids=str,
)
def test_plain_strings_are_those_of_the_enumeration(alias: types.UnionType) -> None:
    enumeration, *used, strings = get_args(alias)
    assert used in ([], [models.SolverUsed], [models.SurfaceModelUsed])  # what an answer reports can be sent back
    assert typing.get_origin(strings) is Literal
    assert set(get_args(strings)) == {member.value for member in enumeration}


def test_every_option_is_described() -> None:
    kinds = [kind for kind in vars(options).values() if typing.is_typeddict(kind)]
    assert len(kinds) > 7
    for kind in kinds:
        described = [entry.partition(" : ")[0] for entry in keywords._descriptions(kind)]
        assert described == list(kind.__annotations__)


def test_what_may_be_free_is_the_enumeration() -> None:
    assert set(selection.Bounds.__annotations__) == {member.value for member in models.SelectionParameter}


def band(answer: gramian.Posterior) -> Array:
    """Returns the width of a band. mypy checks that variances are an array, not an array or None."""
    return 2 * 1.96 * np.sqrt(answer.variances)


def test_members_that_a_request_asks_for_are_never_none_to_a_type_checker() -> None:
    line = gramian.Client().cloud([[0.0], [1.0], [2.0]])
    assert band(line.posterior([0.0, 1.0, 0.0], [[0.5]], include="variances", kernel="gauss", alpha=0.1)).shape == (1,)
    kinds = [getattr(answers, name) for name in answers.__all__]
    found = {(kind.__name__, name): how for kind in kinds for name, how in vars(kind).items() if isinstance(how, Asked)}
    assert len(found) > 30
    for kind, name in found:
        hint = inspect.get_annotations(getattr(answers, kind))[name]
        assert hint in ("Array", "float"), (kind, name)


def test_how_to_ask_is_what_the_methods_take() -> None:
    methods = {
        answers.Interpolation: "interpolate",
        answers.InterpolationBatch: "interpolate_batch",
        answers.Posterior: "posterior",
        answers.PosteriorBatch: "posterior_batch",
        answers.Normals: "normals",
        answers.Curvatures: "curvatures",
        answers.SurfaceGradient: "surface_gradient",
        answers.LaplaceBeltrami: "laplace_beltrami",
    }
    cloud = gramian.Client().cloud(np.random.default_rng(0).normal(size=(40, 2)))
    for kind, method in methods.items():
        asked = {name: how.how for name, how in vars(kind).items() if isinstance(how, Asked)}
        values = np.arange(40.0) if method.endswith("batch") is False else np.arange(80.0).reshape(2, 40)
        given = {} if kind in (answers.Normals, answers.Curvatures) else {"values": values}
        for name, how in asked.items():
            answer = getattr(cloud, method)(**given, queries=[[0.1, 0.2]], **eval(f"dict({how})"))
            assert hasattr(answer, name), (method, how)
