from http import HTTPStatus
from typing import Any

import httpx

from ... import errors
from ...client import AuthenticatedClient, Client
from ...models.level_set_request import LevelSetRequest
from ...models.level_set_response import LevelSetResponse
from ...models.problem import Problem
from ...types import File, Response


def _get_kwargs(
    *,
    body: LevelSetRequest | File,
) -> dict[str, Any]:
    headers: dict[str, Any] = {}

    _kwargs: dict[str, Any] = {
        "method": "post",
        "url": "/v1/level-set",
    }

    if isinstance(body, LevelSetRequest):
        _kwargs["json"] = body.to_dict()

        headers["Content-Type"] = "application/json"
    if isinstance(body, File):
        _kwargs["content"] = body.payload
        headers["Content-Type"] = body.mime_type or "application/x-safetensors"

    _kwargs["headers"] = headers
    return _kwargs


def _parse_response(
    *, client: AuthenticatedClient | Client, response: httpx.Response
) -> LevelSetResponse | Problem | None:
    if response.status_code == 200:
        response_200 = LevelSetResponse.from_dict(response.json())

        return response_200

    if response.status_code == 400:
        response_400 = Problem.from_dict(response.json())

        return response_400

    if response.status_code == 401:
        response_401 = Problem.from_dict(response.json())

        return response_401

    if response.status_code == 404:
        response_404 = Problem.from_dict(response.json())

        return response_404

    if response.status_code == 406:
        response_406 = Problem.from_dict(response.json())

        return response_406

    if response.status_code == 408:
        response_408 = Problem.from_dict(response.json())

        return response_408

    if response.status_code == 413:
        response_413 = Problem.from_dict(response.json())

        return response_413

    if response.status_code == 415:
        response_415 = Problem.from_dict(response.json())

        return response_415

    if response.status_code == 422:
        response_422 = Problem.from_dict(response.json())

        return response_422

    if response.status_code == 429:
        response_429 = Problem.from_dict(response.json())

        return response_429

    if response.status_code == 500:
        response_500 = Problem.from_dict(response.json())

        return response_500

    if response.status_code == 503:
        response_503 = Problem.from_dict(response.json())

        return response_503

    if response.status_code == 504:
        response_504 = Problem.from_dict(response.json())

        return response_504

    if client.raise_on_unexpected_status:
        raise errors.UnexpectedStatus(response.status_code, response.content)
    else:
        return None


def _build_response(
    *, client: AuthenticatedClient | Client, response: httpx.Response
) -> Response[LevelSetResponse | Problem]:
    return Response(
        status_code=HTTPStatus(response.status_code),
        content=response.content,
        headers=response.headers,
        parsed=_parse_response(client=client, response=response),
    )


def sync_detailed(
    *,
    client: AuthenticatedClient | Client,
    body: LevelSetRequest | File,
) -> Response[LevelSetResponse | Problem]:
    """Mesh a surface

     Returns the level set of a function as closed polylines (in the plane) or as a triangle mesh (in
    space), followed from the points of the cloud on a lattice with edges of `step`. The mesh is a
    manifold, and closed wherever `bounds` does not cut it. Without `values` it is the surface that the
    cloud samples: the level of its signature function, or for large clouds that of local regressions,
    closed by winding numbers where the cloud has holes. Each vertex says what it rests on. With
    `include`, vertices have curvatures and error bars.

    Args:
        body (LevelSetRequest): A cloud in the plane or in space whose surface is to be meshed, or
            values whose level is.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[LevelSetResponse | Problem]
    """

    kwargs = _get_kwargs(
        body=body,
    )

    response = client.get_httpx_client().request(
        **kwargs,
    )

    return _build_response(client=client, response=response)


def sync(
    *,
    client: AuthenticatedClient | Client,
    body: LevelSetRequest | File,
) -> LevelSetResponse | Problem | None:
    """Mesh a surface

     Returns the level set of a function as closed polylines (in the plane) or as a triangle mesh (in
    space), followed from the points of the cloud on a lattice with edges of `step`. The mesh is a
    manifold, and closed wherever `bounds` does not cut it. Without `values` it is the surface that the
    cloud samples: the level of its signature function, or for large clouds that of local regressions,
    closed by winding numbers where the cloud has holes. Each vertex says what it rests on. With
    `include`, vertices have curvatures and error bars.

    Args:
        body (LevelSetRequest): A cloud in the plane or in space whose surface is to be meshed, or
            values whose level is.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        LevelSetResponse | Problem
    """

    return sync_detailed(
        client=client,
        body=body,
    ).parsed


async def asyncio_detailed(
    *,
    client: AuthenticatedClient | Client,
    body: LevelSetRequest | File,
) -> Response[LevelSetResponse | Problem]:
    """Mesh a surface

     Returns the level set of a function as closed polylines (in the plane) or as a triangle mesh (in
    space), followed from the points of the cloud on a lattice with edges of `step`. The mesh is a
    manifold, and closed wherever `bounds` does not cut it. Without `values` it is the surface that the
    cloud samples: the level of its signature function, or for large clouds that of local regressions,
    closed by winding numbers where the cloud has holes. Each vertex says what it rests on. With
    `include`, vertices have curvatures and error bars.

    Args:
        body (LevelSetRequest): A cloud in the plane or in space whose surface is to be meshed, or
            values whose level is.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[LevelSetResponse | Problem]
    """

    kwargs = _get_kwargs(
        body=body,
    )

    response = await client.get_async_httpx_client().request(**kwargs)

    return _build_response(client=client, response=response)


async def asyncio(
    *,
    client: AuthenticatedClient | Client,
    body: LevelSetRequest | File,
) -> LevelSetResponse | Problem | None:
    """Mesh a surface

     Returns the level set of a function as closed polylines (in the plane) or as a triangle mesh (in
    space), followed from the points of the cloud on a lattice with edges of `step`. The mesh is a
    manifold, and closed wherever `bounds` does not cut it. Without `values` it is the surface that the
    cloud samples: the level of its signature function, or for large clouds that of local regressions,
    closed by winding numbers where the cloud has holes. Each vertex says what it rests on. With
    `include`, vertices have curvatures and error bars.

    Args:
        body (LevelSetRequest): A cloud in the plane or in space whose surface is to be meshed, or
            values whose level is.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        LevelSetResponse | Problem
    """

    return (
        await asyncio_detailed(
            client=client,
            body=body,
        )
    ).parsed
