from http import HTTPStatus
from typing import Any
from urllib.parse import quote

import httpx

from ... import errors
from ...client import AuthenticatedClient, Client
from ...models.cloud import Cloud
from ...models.problem import Problem
from ...types import Response


def _get_kwargs(
    cloud_id: str,
) -> dict[str, Any]:

    _kwargs: dict[str, Any] = {
        "method": "get",
        "url": "/v1/clouds/{cloud_id}".format(
            cloud_id=quote(str(cloud_id), safe=""),
        ),
    }

    return _kwargs


def _parse_response(*, client: AuthenticatedClient | Client, response: httpx.Response) -> None | Cloud | Problem:
    if response.status_code == 200:
        response_200 = Cloud.from_dict(response.json())

        return response_200

    if response.status_code == 304:
        response_304 = None
        return response_304

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
) -> Response[None | Cloud | Problem]:
    return Response(
        status_code=HTTPStatus(response.status_code),
        content=response.content,
        headers=response.headers,
        parsed=_parse_response(client=client, response=response),
    )


def sync_detailed(
    cloud_id: str,
    *,
    client: AuthenticatedClient | Client,
) -> Response[None | Cloud | Problem]:
    """Describe a cloud

     Returns the size of the cloud, the box around it and the distances between its points, but not the
    points.
    `ETag` and `If-None-Match` save the body. The request counts as use, so the cloud is not the next to
    be
    dropped.

    Args:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and
            the normals if given.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[None | Cloud | Problem]
    """

    kwargs = _get_kwargs(
        cloud_id=cloud_id,
    )

    response = client.get_httpx_client().request(
        **kwargs,
    )

    return _build_response(client=client, response=response)


def sync(
    cloud_id: str,
    *,
    client: AuthenticatedClient | Client,
) -> None | Cloud | Problem:
    """Describe a cloud

     Returns the size of the cloud, the box around it and the distances between its points, but not the
    points.
    `ETag` and `If-None-Match` save the body. The request counts as use, so the cloud is not the next to
    be
    dropped.

    Args:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and
            the normals if given.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        None | Cloud | Problem
    """

    return sync_detailed(
        cloud_id=cloud_id,
        client=client,
    ).parsed


async def asyncio_detailed(
    cloud_id: str,
    *,
    client: AuthenticatedClient | Client,
) -> Response[None | Cloud | Problem]:
    """Describe a cloud

     Returns the size of the cloud, the box around it and the distances between its points, but not the
    points.
    `ETag` and `If-None-Match` save the body. The request counts as use, so the cloud is not the next to
    be
    dropped.

    Args:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and
            the normals if given.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[None | Cloud | Problem]
    """

    kwargs = _get_kwargs(
        cloud_id=cloud_id,
    )

    response = await client.get_async_httpx_client().request(**kwargs)

    return _build_response(client=client, response=response)


async def asyncio(
    cloud_id: str,
    *,
    client: AuthenticatedClient | Client,
) -> None | Cloud | Problem:
    """Describe a cloud

     Returns the size of the cloud, the box around it and the distances between its points, but not the
    points.
    `ETag` and `If-None-Match` save the body. The request counts as use, so the cloud is not the next to
    be
    dropped.

    Args:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and
            the normals if given.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        None | Cloud | Problem
    """

    return (
        await asyncio_detailed(
            cloud_id=cloud_id,
            client=client,
        )
    ).parsed
