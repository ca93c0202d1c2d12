"""A stand-in for a Kubernetes cluster, which answers the chart's questions about existing objects."""

import contextlib
import http.server
import json
import threading

import helm_python as helm
import yaml

APPS = "apps/v1"
RESOURCE = {"name": "statefulsets", "singularName": "statefulset", "namespaced": True, "kind": "StatefulSet"}
NOT_FOUND = {"kind": "Status", "apiVersion": "v1", "status": "Failure", "reason": "NotFound", "code": 404}


@contextlib.contextmanager
def cluster(name, namespace, n_replicas):
    """Yields Helm's configuration for a cluster that has only a StatefulSet with n_replicas replicas."""
    version = {"groupVersion": APPS, "version": "v1"}
    live = {"apiVersion": APPS, "kind": "StatefulSet", "metadata": {"name": name, "namespace": namespace}}
    answers = {
        "/version": {"major": "1", "minor": "30", "gitVersion": "v1.30.0"},
        "/api": {"kind": "APIVersions", "versions": ["v1"]},
        "/api/v1": {"kind": "APIResourceList", "groupVersion": "v1", "resources": []},
        "/apis": {
            "kind": "APIGroupList",
            "apiVersion": "v1",
            "groups": [{"name": "apps", "versions": [version], "preferredVersion": version}],
        },
        f"/apis/{APPS}": {
            "kind": "APIResourceList",
            "groupVersion": APPS,
            "resources": [{**RESOURCE, "verbs": ["get"]}],
        },
        f"/apis/{APPS}/namespaces/{namespace}/statefulsets/{name}": {**live, "spec": {"replicas": n_replicas}},
    }

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            answer = answers.get(self.path.split("?")[0], NOT_FOUND)
            body = json.dumps(answer).encode()
            self.send_response(404 if answer is NOT_FOUND else 200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            """Logs nothing."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answer)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    kubeconfig = {
        "apiVersion": "v1",
        "kind": "Config",
        "clusters": [{"name": "here", "cluster": {"server": f"http://127.0.0.1:{server.server_port}"}}],
        "users": [{"name": "anybody", "user": {}}],
        "contexts": [{"name": "here", "context": {"cluster": "here", "user": "anybody"}}],
        "current-context": "here",
    }
    try:
        with helm.Config(kubeconfig_content=yaml.safe_dump(kubeconfig), namespace=namespace) as config:
            yield config
    finally:
        server.shutdown()
        server.server_close()
