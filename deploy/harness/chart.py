"""Checks of the shipped files that need no running fleet.

The Helm chart is rendered by Helm's own engine and validated by the schemas of Kubernetes. compose.yaml and
envoy.yaml are checked as text.
"""

import re

import helm_python as helm
import kubernetes_validate
import yaml
from cluster import cluster
from fleet import DEPLOY, REPLICAS

CHART = DEPLOY / "helm/gramian"
OPEN = {"keys": {"allowAnonymous": True}}
KEYS = {"keys": {"file": '[[key]]\nname = "a"\nhash = "blake3:00"\n'}}
STORE = {"store": {"url": "s3://bucket/prefix", "variables": {"AWS_REGION": "x"}, "existingSecret": "bucket"}}
# Settings as Helm reads them from a file of values: numbers are floating-point.
SETTINGS = {"GRAMIAN_CACHE_BYTES": 8589934592.0, "GRAMIAN_DEADLINE_SECONDS": 2.5, "OTEL_TRACES_SAMPLER": "traceidratio"}
WRITTEN = ['"8589934592"', '"2.5"', '"traceidratio"']
# Number of objects by kind that the chart makes by default. `VARIANTS`: values that users would set, with the
# kinds that they result in.
BASE = {"ServiceAccount": 1, "Service": 2, "StatefulSet": 1, "ConfigMap": 1, "Deployment": 1, "PodDisruptionBudget": 2}
VARIANTS = {
    "open, one router": ({**OPEN, "router": {"replicas": 1}}, BASE),
    "keys and store": ({**KEYS, **STORE, "settings": SETTINGS}, {**BASE, "Secret": 1}),
    "a Secret of one's own": ({"keys": {"existingSecret": "mine"}, **STORE}, BASE),
    "all of it": (
        {**OPEN, **STORE, "autoscaling": {"enabled": True}, "networkPolicy": {"enabled": True}}
        | {"podMonitor": {"enabled": True}, "nodeSelector": {"disk": "ssd"}, "tolerations": [{"operator": "Exists"}]},
        {**BASE, "HorizontalPodAutoscaler": 1, "NetworkPolicy": 1, "PodMonitor": 2},
    ),
}
# Values that have to be refused, by the words that the refusal contains.
REFUSED = {"who may use": {}, "schema": {**OPEN, "settings": {"GRAMIAN_THREAD-S": "1"}}}


def check(report):
    """Lints and renders the chart, validates its objects, and checks the files of router and fleet."""
    chart = helm.Chart.load(str(CHART))
    lint = helm.lint(str(CHART), OPEN, strict=True)
    errors = [message for message in lint["messages"] if message["severity"] > 1]
    report.line("helm lint", f"{len(errors)} errors and warnings", not errors and not lint["errors"])
    print("".join(f"            {error}\n" for error in errors), end="")
    for what, (values, kinds) in VARIANTS.items():
        documents = rendered(chart, values)
        found = {kind: sum(document["kind"] == kind for document in documents) for kind in kinds}
        report.line(f"chart, {what}: objects", len(documents), found == kinds and len(documents) == sum(kinds.values()))
        invalid = [fault for document in documents for fault in faults(document)]
        report.line(f"chart, {what}: invalid ones", len(invalid), not invalid)
        print("".join(f"            {fault}\n" for fault in invalid), end="")
    for what, values in REFUSED.items():
        report.line(f"chart refuses: {what}", refusal(chart, values) or "nothing", what in refusal(chart, values))
    text = "".join(chart.render(VARIANTS["keys and store"][0], name="gramian", namespace="test").values())
    missing = [value for value in WRITTEN if f"value: {value}" not in text]
    report.line("the chart's settings as the server reads them, missing", missing or "none", not missing)
    pod = stateful_set(rendered(chart, {**OPEN, **STORE}))["template"]["spec"]
    variables = {variable["name"]: variable["value"] for variable in pod["containers"][0]["env"]}
    required, linked = variables["GRAMIAN_STORE_REQUIRED"], pod["enableServiceLinks"]
    report.line("chart: ready only while the store takes clouds", required, required == "0")
    report.line("chart: variables of services beside those of the server", linked, not linked)
    scaling(report, chart)
    compare_routers(report, rendered(chart, {**OPEN, "router": {"replicas": 1}}))
    compose(report)
    envoy(report)


def rendered(chart, values, live=None):
    """Returns the objects that the chart makes. It may ask the cluster `live` for existing objects."""
    release = {"name": "gramian", "namespace": "test"}
    files = live.render(chart, values, **release) if live else chart.render(values, **release)
    documents = [
        document for name, text in files.items() if name.endswith(".yaml") for document in yaml.safe_load_all(text)
    ]
    return [document for document in documents if document]


def scaling(report, chart):
    """Checks that turning autoscaling on keeps the existing number of replicas."""

    def n_replicas(n, is_on, live=None):
        values = {**OPEN, "replicas": n, "autoscaling": {"enabled": is_on, "minReplicas": 3}}
        return stateful_set(rendered(chart, values, live))["replicas"]

    new = [n_replicas(2, False), n_replicas(2, True), n_replicas(4, True)]
    report.line("chart: replicas where none are, 2 without autoscaling, 2 and 4 with it", new, new == [2, 3, 4])
    with cluster("gramian", "test", 7) as live:
        kept = [n_replicas(2, False, live), n_replicas(2, True, live)]
    report.line("chart: replicas where 7 are, 2 without autoscaling and with it", kept, kept == [2, 7])


def stateful_set(documents):
    """Returns the specification of the replicas."""
    return next(document["spec"] for document in documents if document["kind"] == "StatefulSet")


def faults(document):
    """Returns the faults of an object by the schema of Kubernetes. Objects of operators have no schema."""
    if document["kind"] == "PodMonitor":
        return []
    try:
        kubernetes_validate.validate(document, "1.30", strict=True)
    except kubernetes_validate.ValidationError as error:
        return [f"{document['kind']} {document['metadata']['name']}: {error.message} at {list(error.path)}"]
    return []


def refusal(chart, values):
    """Returns the message that refuses values, or an empty string if they are accepted."""
    try:
        chart.validate_schema(values)
    except helm.HelmError as error:
        return f"schema: {str(error).splitlines()[-1]}"[:60]
    try:
        chart.render(values, name="gramian", namespace="test")
    except helm.HelmError as error:
        return re.sub(r"^.*say ", "say ", str(error), flags=re.DOTALL)[:60]
    return ""


def compare_routers(report, documents):
    """Checks that the chart's haproxy.cfg is the tested one, apart from comments and names of replicas."""
    texts = [document["data"]["haproxy.cfg"] for document in documents if document["kind"] == "ConfigMap"]
    for number, name in enumerate(REPLICAS):
        texts = [text.replace(f"gramian-{number}.gramian-replicas.test.svc.cluster.local", name) for text in texts]
        texts = [text.replace(f"gramian-{number}", name) for text in texts]
    shipped = (DEPLOY / "haproxy/haproxy.cfg").read_text()
    is_same = [statements(text) for text in texts] == [statements(shipped)]
    report.line("the chart's haproxy.cfg is the tested one", is_same, is_same)


def statements(text):
    """Returns the lines that are neither empty nor comments."""
    return [line.strip() for line in text.splitlines() if line.strip() and not line.strip().startswith("#")]


def compose(report):
    """Checks that all files and services named in compose.yaml exist, and that the image gets no secrets."""
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
    mounts = [
        volume for service in services.values() for volume in service.get("volumes", []) if volume.startswith("./")
    ]
    absent = [
        mount for mount in mounts if not (DEPLOY / mount.split(":")[0]).exists() and not mount.startswith("./keys")
    ]
    absent += [name for service in services.values() for name in service.get("depends_on", {}) if name not in services]
    absent += [name for name in REPLICAS if name not in services]
    report.line("compose.yaml: files and services that are missing", absent or "none", not absent)
    lines = (DEPLOY / ".gitignore").read_text().splitlines()
    secrets = {f"deploy/{line.strip('/')}" for line in lines if line.startswith("/")}
    sent = secrets - set((DEPLOY.parent / ".dockerignore").read_text().splitlines())
    report.line("compose.yaml: secrets that are sent to the build of the image", sorted(sent) or "none", not sent)


def envoy(report):
    """Checks that no route limits the time of whole answers: streams, such as events of jobs, never end."""
    text = (DEPLOY / "envoy/envoy.yaml").read_text()
    timeouts = re.findall(r"^ +cluster: replicas\n +timeout: (\S+)$", text, re.MULTILINE)
    n_routes = len(re.findall(r"^ +route:$", text, re.MULTILINE))
    holds = timeouts == ["0s"] * n_routes and n_routes > 0
    report.line("envoy.yaml: ends of whole answers, by route", timeouts, holds)
