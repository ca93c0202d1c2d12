"""A scenario with only the generated client, as its users would write it."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from http import HTTPStatus

import pytest

from gramian.rest import Client
from gramian.rest.api.clouds import create_cloud
from gramian.rest.api.geometry import compute_curvatures
from gramian.rest.api.operators import assemble_laplace_beltrami_matrix
from gramian.rest.api.values import compute_posterior
from gramian.rest.models import (
    Cloud,
    CloudInput,
    CloudRequest,
    CurvaturesRequest,
    CurvaturesResponse,
    FactorizationUsed,
    FlagReason,
    Kernel,
    KernelFamily,
    LaplaceBeltramiMatrixRequest,
    LaplaceBeltramiMatrixResponse,
    PosteriorQuantity,
    PosteriorRequest,
    PosteriorResponse,
    Problem,
    SurfaceModelUsed,
)
from gramian.rest.types import Unset

ANGLES = [i * math.pi / 4 for i in range(8)]
COSINES = [math.cos(angle) for angle in ANGLES]
CIRCLE = [[math.cos(angle), math.sin(angle)] for angle in ANGLES]
GAUSS = Kernel(family=KernelFamily.GAUSS, length_scale=2.0)


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with Client(base_url=os.environ["GRAMIAN_URL"]) as client:
        yield client


@pytest.fixture(scope="module")
def cloud(client: Client) -> CloudInput:
    registered = create_cloud.sync(client=client, body=CloudRequest(points=CIRCLE))
    assert isinstance(registered, Cloud)
    assert (registered.n_points, registered.dimension, registered.n_duplicates) == (8, 2, 0)
    assert registered.bounding_box.min_ == pytest.approx([-1, -1])
    assert not isinstance(registered.spacing, Unset)
    assert registered.spacing.median == pytest.approx(2 * math.sin(math.pi / 8))
    assert registered.created_at.tzinfo is not None
    return CloudInput(id=registered.cloud_id)


def test_curvatures_with_a_null_entry(client: Client, cloud: CloudInput) -> None:
    request = CurvaturesRequest(cloud=cloud, kernel=GAUSS, alpha=0.0, queries=[[1.0, 0.0], [0.0, 0.0]])
    answer = compute_curvatures.sync(client=client, body=request)
    assert isinstance(answer, CurvaturesResponse)

    on_the_circle, at_the_centre = answer.principal_curvatures
    assert on_the_circle == pytest.approx([1.0], abs=1e-4)
    assert at_the_centre is None
    assert answer.normals[0] == pytest.approx([1.0, 0.0], abs=1e-6)
    assert answer.normals[1] is None
    assert answer.principal_directions[1] is None
    assert answer.mean_curvatures[1] is None

    assert answer.surface_models == [SurfaceModelUsed.SIGNATURE, SurfaceModelUsed.SIGNATURE]
    assert isinstance(answer.surface_models[0], SurfaceModelUsed)
    [flags] = answer.flags
    assert (flags.query, flags.reason) == (1, FlagReason.VANISHING_GRADIENT)
    assert isinstance(flags.reason, FlagReason)
    assert answer.diagnostics.kernel.family is KernelFamily.GAUSS
    assert answer.diagnostics.factorization is FactorizationUsed.CHOLESKY
    assert answer.diagnostics.alpha == 0.0


def test_laplace_beltrami_matrix(client: Client, cloud: CloudInput) -> None:
    request = LaplaceBeltramiMatrixRequest(cloud=cloud, kernel=GAUSS, alpha=0.0)
    answer = assemble_laplace_beltrami_matrix.sync(client=client, body=request)
    assert isinstance(answer, LaplaceBeltramiMatrixResponse)
    assert len(answer.matrix) == 8
    for row, cosine in zip(answer.matrix, COSINES, strict=True):
        assert row is not None
        assert len(row) == 8
        # Δ cos θ = −cos θ. Eight points and this kernel reproduce it to 2.4e-6, as docs/walkthrough.md shows
        # at (1, 0). With a condition number of 3e3 and entries of 5, rounding stays below 1e-11.
        assert sum(x * y for x, y in zip(row, COSINES, strict=True)) == pytest.approx(-cosine, abs=1e-5)


def test_posterior_with_variance(client: Client, cloud: CloudInput) -> None:
    request = PosteriorRequest(
        cloud=cloud,
        values=COSINES,
        queries=[[0.9, 0.1]],
        kernel=GAUSS,
        alpha=1e-6,
        include=[PosteriorQuantity.VARIANCES],
    )
    answer = compute_posterior.sync(client=client, body=request)
    assert isinstance(answer, PosteriorResponse)
    # The values are samples of the function x, and the mean is close to it.
    assert answer.means == pytest.approx([0.9], abs=0.05)
    assert not isinstance(answer.variances, Unset)
    [variance] = answer.variances
    assert 0 <= variance < 0.01
    assert isinstance(answer.covariance, Unset)


def test_a_422_is_a_problem_with_a_pointer(client: Client, cloud: CloudInput) -> None:
    request = CurvaturesRequest(cloud=cloud, kernel=Kernel(family=KernelFamily.GAUSS, length_scale=-1.0))
    response = compute_curvatures.sync_detailed(client=client, body=request)
    assert response.status_code is HTTPStatus.UNPROCESSABLE_ENTITY
    problem = response.parsed
    assert isinstance(problem, Problem)
    assert problem.type_ == "/problems/invalid-request"
    assert problem.instance == response.headers["X-Request-Id"]
    assert not isinstance(problem.errors, Unset)
    assert problem.errors[0].pointer == "/kernel/length_scale"
    assert isinstance(problem.minimum_alpha, Unset)
