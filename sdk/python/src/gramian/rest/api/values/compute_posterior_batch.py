from http import HTTPStatus
from typing import Any

import httpx

from ... import errors
from ...client import AuthenticatedClient, Client
from ...models.posterior_batch_request import PosteriorBatchRequest
from ...models.posterior_batch_response import PosteriorBatchResponse
from ...models.problem import Problem
from ...types import File, Response


def _get_kwargs(
    *,
    body: PosteriorBatchRequest | File,
) -> dict[str, Any]:
    headers: dict[str, Any] = {}

    _kwargs: dict[str, Any] = {
        "method": "post",
        "url": "/v1/posterior/batch",
    }

    if isinstance(body, PosteriorBatchRequest):
        _kwargs["json"] = body.to_dict()

        headers["Content-Type"] = "application/json"
    if isinstance(body, File):
        _kwargs["content"] = body.payload
        headers["Content-Type"] = body.mime_type or "application/x-safetensors"

    _kwargs["headers"] = headers
    return _kwargs


def _parse_response(
    *, client: AuthenticatedClient | Client, response: httpx.Response
) -> PosteriorBatchResponse | Problem | None:
    if response.status_code == 200:
        response_200 = PosteriorBatchResponse.from_dict(response.json())

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
) -> Response[PosteriorBatchResponse | Problem]:
    return Response(
        status_code=HTTPStatus(response.status_code),
        content=response.content,
        headers=response.headers,
        parsed=_parse_response(client=client, response=response),
    )


def sync_detailed(
    *,
    client: AuthenticatedClient | Client,
    body: PosteriorBatchRequest | File,
) -> Response[PosteriorBatchResponse | Problem]:
    """Compute Gaussian process posteriors of many lists of values

     Computes the posterior of each list as `/v1/posterior` does, with one factorization for all lists. A
    kernel that is not given is learned from all lists together. Batches need the dense solver.

    Args:
        body (PosteriorBatchRequest): Many lists of noisy values at the points of a cloud, and
            queries for their posteriors.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[PosteriorBatchResponse | Problem]
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
    body: PosteriorBatchRequest | File,
) -> PosteriorBatchResponse | Problem | None:
    """Compute Gaussian process posteriors of many lists of values

     Computes the posterior of each list as `/v1/posterior` does, with one factorization for all lists. A
    kernel that is not given is learned from all lists together. Batches need the dense solver.

    Args:
        body (PosteriorBatchRequest): Many lists of noisy values at the points of a cloud, and
            queries for their posteriors.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        PosteriorBatchResponse | Problem
    """

    return sync_detailed(
        client=client,
        body=body,
    ).parsed


async def asyncio_detailed(
    *,
    client: AuthenticatedClient | Client,
    body: PosteriorBatchRequest | File,
) -> Response[PosteriorBatchResponse | Problem]:
    """Compute Gaussian process posteriors of many lists of values

     Computes the posterior of each list as `/v1/posterior` does, with one factorization for all lists. A
    kernel that is not given is learned from all lists together. Batches need the dense solver.

    Args:
        body (PosteriorBatchRequest): Many lists of noisy values at the points of a cloud, and
            queries for their posteriors.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[PosteriorBatchResponse | Problem]
    """

    kwargs = _get_kwargs(
        body=body,
    )

    response = await client.get_async_httpx_client().request(**kwargs)

    return _build_response(client=client, response=response)


async def asyncio(
    *,
    client: AuthenticatedClient | Client,
    body: PosteriorBatchRequest | File,
) -> PosteriorBatchResponse | Problem | None:
    """Compute Gaussian process posteriors of many lists of values

     Computes the posterior of each list as `/v1/posterior` does, with one factorization for all lists. A
    kernel that is not given is learned from all lists together. Batches need the dense solver.

    Args:
        body (PosteriorBatchRequest): Many lists of noisy values at the points of a cloud, and
            queries for their posteriors.
        body (File): Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the
            same name, with dots for nesting (`cloud.points`). All other fields are JSON text in the
            metadata entry `request`. At most 64 tensors; header at most 64 KiB.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        PosteriorBatchResponse | Problem
    """

    return (
        await asyncio_detailed(
            client=client,
            body=body,
        )
    ).parsed
