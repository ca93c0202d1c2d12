from http import HTTPStatus
from typing import Any

import httpx

from ... import errors
from ...client import AuthenticatedClient, Client
from ...models.cloud import Cloud
from ...models.cloud_request import CloudRequest
from ...models.problem import Problem
from ...types import File, Response


def _get_kwargs(
    *,
    body: CloudRequest | File,
) -> dict[str, Any]:
    headers: dict[str, Any] = {}

    _kwargs: dict[str, Any] = {
        "method": "post",
        "url": "/v1/clouds",
    }

    if isinstance(body, CloudRequest):
        _kwargs["json"] = body.to_dict()

        headers["Content-Type"] = "application/json"
    if isinstance(body, File):
        _kwargs["content"] = body.payload
        headers["Content-Type"] = body.mime_type or "application/x-safetensors"
    if isinstance(body, File):
        _kwargs["content"] = body.payload
        headers["Content-Type"] = body.mime_type or "application/x-safetensors"
    if isinstance(body, File):
        _kwargs["content"] = body.payload
        headers["Content-Type"] = body.mime_type or "application/x-safetensors"

    _kwargs["headers"] = headers
    return _kwargs


def _parse_response(*, client: AuthenticatedClient | Client, response: httpx.Response) -> Cloud | Problem | None:
    if response.status_code == 200:
        response_200 = Cloud.from_dict(response.json())

        return response_200

    if response.status_code == 201:
        response_201 = Cloud.from_dict(response.json())

        return response_201

    if response.status_code == 400:
        response_400 = Problem.from_dict(response.json())

        return response_400

    if response.status_code == 401:
        response_401 = Problem.from_dict(response.json())

        return response_401

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


def _build_response(*, client: AuthenticatedClient | Client, response: httpx.Response) -> Response[Cloud | Problem]:
    return Response(
        status_code=HTTPStatus(response.status_code),
        content=response.content,
        headers=response.headers,
        parsed=_parse_response(client=client, response=response),
    )


def sync_detailed(
    *,
    client: AuthenticatedClient | Client,
    body: CloudRequest | File,
) -> Response[Cloud | Problem]:
    """Register a cloud

     Keeps the points under an id, so that later requests need not repeat them. The id is the hash of the
    coordinates: posting the same points again answers 200 with the same id. Clouds live in a bounded
    store,
    which drops the least recently used first.

    Args:
        body (CloudRequest): Points to register.
        body (File): The points, `[n, d]`, as little- or big-endian float64 or float32.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.
        body (File): PLY 1.0, ascii or binary of either byte order. The properties x, y, z of
            element vertex are the points, and nx, ny, nz their normals if all three are there, of any
            type of number; other properties and elements are ignored.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[Cloud | Problem]
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
    body: CloudRequest | File,
) -> Cloud | Problem | None:
    """Register a cloud

     Keeps the points under an id, so that later requests need not repeat them. The id is the hash of the
    coordinates: posting the same points again answers 200 with the same id. Clouds live in a bounded
    store,
    which drops the least recently used first.

    Args:
        body (CloudRequest): Points to register.
        body (File): The points, `[n, d]`, as little- or big-endian float64 or float32.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.
        body (File): PLY 1.0, ascii or binary of either byte order. The properties x, y, z of
            element vertex are the points, and nx, ny, nz their normals if all three are there, of any
            type of number; other properties and elements are ignored.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Cloud | Problem
    """

    return sync_detailed(
        client=client,
        body=body,
    ).parsed


async def asyncio_detailed(
    *,
    client: AuthenticatedClient | Client,
    body: CloudRequest | File,
) -> Response[Cloud | Problem]:
    """Register a cloud

     Keeps the points under an id, so that later requests need not repeat them. The id is the hash of the
    coordinates: posting the same points again answers 200 with the same id. Clouds live in a bounded
    store,
    which drops the least recently used first.

    Args:
        body (CloudRequest): Points to register.
        body (File): The points, `[n, d]`, as little- or big-endian float64 or float32.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.
        body (File): PLY 1.0, ascii or binary of either byte order. The properties x, y, z of
            element vertex are the points, and nx, ny, nz their normals if all three are there, of any
            type of number; other properties and elements are ignored.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[Cloud | Problem]
    """

    kwargs = _get_kwargs(
        body=body,
    )

    response = await client.get_async_httpx_client().request(**kwargs)

    return _build_response(client=client, response=response)


async def asyncio(
    *,
    client: AuthenticatedClient | Client,
    body: CloudRequest | File,
) -> Cloud | Problem | None:
    """Register a cloud

     Keeps the points under an id, so that later requests need not repeat them. The id is the hash of the
    coordinates: posting the same points again answers 200 with the same id. Clouds live in a bounded
    store,
    which drops the least recently used first.

    Args:
        body (CloudRequest): Points to register.
        body (File): The points, `[n, d]`, as little- or big-endian float64 or float32.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.
        body (File): PLY 1.0, ascii or binary of either byte order. The properties x, y, z of
            element vertex are the points, and nx, ny, nz their normals if all three are there, of any
            type of number; other properties and elements are ignored.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Cloud | Problem
    """

    return (
        await asyncio_detailed(
            client=client,
            body=body,
        )
    ).parsed
