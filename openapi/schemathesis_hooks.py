"""Hooks that make random requests of Schemathesis meaningful.

A schema cannot say that rows have equal length, that lists have one entry per point, or that one of two
alternatives is given. Without these hooks nearly all random clouds are ragged and refused, and nothing behind
the first check is reached. The hooks change only well-formed data of the fuzzing and stateful phases, and
keep it well-formed. Other phases and malformed data are sent as Schemathesis makes them.

Links that refer to a cloud in the body also get the body that their description asks for.
"""

import schemathesis

PHASES = {"fuzzing", "stateful"}
PARAMETER_OF = {"laplace": "epsilon", "matern": "nu", "wendland": "smoothness"}
TRIANGLE = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]


@schemathesis.hook
def before_load_schema(context, raw_schema):
    """Adds the request body to links without parameters, whose document describes it only in words.

    See src/http/openapi/links.rs.
    """
    links = raw_schema["components"]["links"].values()
    bare = [link for link in links if "parameters" not in link]
    assert bare, "no link refers to a cloud in the body"
    for link in bare:
        link["requestBody"] = {"cloud": {"id": "$response.body#/cloud_id"}}


@schemathesis.hook
def before_call(context, case, **kwargs):
    meta = case.meta
    if meta is None or not meta.generation.mode.is_positive or meta.phase.name.value not in PHASES:
        return
    if isinstance(case.body, dict):
        case.body = meaningful(case.body)


def meaningful(request):
    """Makes a request meaningful: one of two alternatives, equal rows, and lists as long as the cloud."""
    if "cloud" not in request:
        return rectangular(request) if "points" in request else request
    request = with_fit(request)
    request["cloud"] = one_cloud(request["cloud"])
    points = request["cloud"].get("points")
    if "geometry" in request:
        request["geometry"] = with_fit(request["geometry"])
        if "cloud" in request["geometry"]:
            request["geometry"]["cloud"] = one_cloud(request["geometry"]["cloud"])
    if points:
        for name in {"values", "noise_variances"} & request.keys():
            request[name] = resized(request[name], len(points))
        if "queries" in request:
            request["queries"] = [resized(row, len(points[0])) for row in request["queries"]]
    return request


def with_fit(fit):
    """Keeps alpha or the noise variances, and only those kernel parameters that the family has."""
    others = {"noise_variances"} if "alpha" in fit else set()
    fit = {name: value for name, value in fit.items() if name not in others}
    if "kernel" in fit:
        family = fit["kernel"].get("family")
        others = set(PARAMETER_OF.values()) - {PARAMETER_OF.get(family)}
        fit["kernel"] = {name: value for name, value in fit["kernel"].items() if name not in others}
    return fit


def one_cloud(cloud):
    """Keeps the points of a cloud where it has some, else its id."""
    if "points" not in cloud:
        return {"id": cloud["id"]} if "id" in cloud else {"points": TRIANGLE}
    return rectangular({name: value for name, value in cloud.items() if name != "id"})


def rectangular(cloud):
    """Gives points and normals rows as long as the first point, and makes as many normals as points."""
    points = cloud["points"] or TRIANGLE
    dimension = max(len(points[0]), 1)
    cloud = {**cloud, "points": [resized(row, dimension) for row in points]}
    if "normals" in cloud:
        normals = resized(cloud["normals"] or [[]], len(points))
        cloud["normals"] = [resized(row, dimension) for row in normals]
    return cloud


def resized(items, length):
    """Cuts or repeats numbers or rows to a length. Uses ones where there are none."""
    items = items or [1.0]
    return [items[i % len(items)] for i in range(length)]
