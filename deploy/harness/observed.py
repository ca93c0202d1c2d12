"""Checks of the dashboard's queries and of the alerts, against a real Prometheus."""

import json
import math
import re
import subprocess
import sys
import urllib.error
import urllib.parse

import yaml
from fleet import DEPLOY
from processes import Failed, free_port, get

sys.path.insert(0, str(DEPLOY / "grafana"))
from panels import queries

# Values that Grafana substitutes for its variables.
VARIABLES = {"$__rate_interval": "1m", "$__range": "5m", "$instance": ".*"}
FAMILY = re.compile(r"\b(?:gramian|haproxy|process)_\w+|\bup\b")


class Prometheus:
    """A Prometheus with the shipped configuration, except that it scrapes every second."""

    def __init__(self, fleet):
        self.fleet = fleet
        self.url = f"http://127.0.0.1:{free_port()}"

    def start(self):
        """Starts Prometheus."""
        directory = self.fleet.processes.directory
        self.fleet.write("prometheus/alerts.yaml", {})
        file = self.fleet.write(
            "prometheus/prometheus.yml",
            {"router:8404": f"127.0.0.1:{self.fleet.metrics_port}", "_interval: 15s": "_interval: 1s"},
        )
        address = self.url.removeprefix("http://")
        command = ["prometheus", f"--config.file={file}", f"--web.listen-address={address}"]
        command += [f"--storage.tsdb.path={directory / 'tsdb'}"]
        self.fleet.processes.start("prometheus", command, ready=f"{self.url}/-/ready")

    def ask(self, path, **parameters):
        """Returns the data that Prometheus answers. Raises `Failed` with its message if it refuses."""
        try:
            body = get(f"{self.url}/api/v1/{path}?{urllib.parse.urlencode(parameters)}")
        except urllib.error.HTTPError as error:
            raise Failed(f"{parameters}: {error.read().decode()}") from error
        return json.loads(body)["data"]

    def numbers(self, query):
        """Returns the finite values of the series of a query."""
        result = self.ask("query", query=query)["result"]
        values = [float(series["value"][1]) for series in result]
        return [value for value in values if math.isfinite(value)]


def dashboard(report, prometheus):
    """Checks that every query of every panel has a number, and that dashboard.json is up to date."""
    silent, asked = [], queries()
    for title, query in asked:
        for name, value in VARIABLES.items():
            query = query.replace(name, value)
        if not prometheus.numbers(query):
            silent.append(f"{title}: {query}")
    report.line("queries of the dashboard that have numbers", f"{len(asked) - len(silent)} of {len(asked)}", not silent)
    print("".join(f"            {line}\n" for line in silent), end="")
    is_new = (
        subprocess.run([sys.executable, "-B", DEPLOY / "grafana/dashboard.py", "--check"], check=False).returncode == 0
    )
    report.line("dashboard.json is that of panels.py", is_new, is_new)


def alerts(report, prometheus):
    """Checks that all alerts are evaluated, that the metrics in them exist, and that their tests pass."""
    rules = [rule for group in prometheus.ask("rules")["groups"] for rule in group["rules"]]
    ill = [f"{rule['name']}: {rule.get('lastError')}" for rule in rules if rule["health"] != "ok"]
    text = (DEPLOY / "prometheus/alerts.yaml").read_text()
    shipped = [rule["expr"] for group in yaml.safe_load(text)["groups"] for rule in group["rules"]]
    families = {family for expression in shipped for family in FAMILY.findall(expression)}
    absent = [family for family in sorted(families) if not prometheus.numbers(f"count({family})")]
    report.line(
        "alerts that are evaluated",
        f"{len(rules) - len(ill)} of {len(shipped)}",
        not ill and len(rules) == len(shipped),
    )
    report.line("families in alerts that are there", f"{len(families) - len(absent)} of {len(families)}", not absent)
    print("".join(f"            {line}\n" for line in ill + absent), end="")
    firing = {
        alert["labels"]["alertname"] for alert in prometheus.ask("alerts")["alerts"] if alert["state"] == "firing"
    }
    print(f"                      firing after all this: {', '.join(sorted(firing)) or 'none'}")
    for command in (
        ["check", "rules", "alerts.yaml"],
        ["check", "config", "prometheus.yml"],
        ["test", "rules", "alerts_test.yaml"],
    ):
        run = subprocess.run(
            ["promtool", *command], cwd=DEPLOY / "prometheus", capture_output=True, text=True, check=False
        )
        report.line(f"promtool {' '.join(command)}", f"status {run.returncode}", run.returncode == 0)
        if run.returncode != 0:
            print(run.stdout, run.stderr)
