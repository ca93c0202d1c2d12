from http import HTTPStatus
from typing import Any
from urllib.parse import quote

import httpx

from ... import errors
from ...client import AuthenticatedClient, Client
from ...types import Response


def _get_kwargs(
    cloud_id: str,
) -> dict[str, Any]:

    _kwargs: dict[str, Any] = {
        "method": "head",
        "url": "/v1/clouds/{cloud_id}".format(
            cloud_id=quote(str(cloud_id), safe=""),
        ),
    }

    return _kwargs


def _parse_response(*, client: AuthenticatedClient | Client, response: httpx.Response) -> None:
    if response.status_code == 200:
        return

    if response.status_code == 304:
        return

    if response.status_code == 400:
        return

    if response.status_code == 401:
        return

    if response.status_code == 404:
        return

    if response.status_code == 429:
        return

    if response.status_code == 500:
        return

    if response.status_code == 503:
        return

    if client.raise_on_unexpected_status:
        raise errors.UnexpectedStatus(response.status_code, response.content)
    else:
        return


def _build_response(*, client: AuthenticatedClient | Client, response: httpx.Response) -> Response[None]:
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
) -> Response[None]:
    """Check for a cloud

     Answers like GET on the same path, without the body.

    Args:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and
            the normals if given.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[None]
    """

    kwargs = _get_kwargs(
        cloud_id=cloud_id,
    )

    response = client.get_httpx_client().request(
        **kwargs,
    )

    return _build_response(client=client, response=response)


async def asyncio_detailed(
    cloud_id: str,
    *,
    client: AuthenticatedClient | Client,
) -> Response[None]:
    """Check for a cloud

     Answers like GET on the same path, without the body.

    Args:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and
            the normals if given.

    Raises:
        errors.UnexpectedStatus: If the server returns an undocumented status code and Client.raise_on_unexpected_status is True.
        httpx.TimeoutException: If the request takes longer than Client.timeout.

    Returns:
        Response[None]
    """

    kwargs = _get_kwargs(
        cloud_id=cloud_id,
    )

    response = await client.get_async_httpx_client().request(**kwargs)

    return _build_response(client=client, response=response)
