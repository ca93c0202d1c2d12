#!/usr/bin/env python3
"""Writes dashboard.json, which Grafana imports, from panels.py.

deploy/grafana/dashboard.py           writes it beside this file
deploy/grafana/dashboard.py --check   fails if it differs from what would be written
"""

import json
import sys
from pathlib import Path

from panels import ROWS

FILE = Path(__file__).parent / "dashboard.json"
WIDTH, HEIGHT = 24, 8


def panel_json(number, panel, place):
    title, unit, queries, description = panel
    glance = place["h"] < HEIGHT
    return {
        "id": number,
        "type": "stat" if glance else "timeseries",
        "title": title,
        "description": description,
        "datasource": {"type": "prometheus", "uid": "${datasource}"},
        "gridPos": place,
        "fieldConfig": {"defaults": {"unit": unit, **({} if glance else {"min": 0})}, "overrides": []},
        "options": {} if glance else {"legend": {"displayMode": "list", "placement": "bottom"}},
        "targets": [
            {"refId": chr(ord("A") + i), "expr": query, "legendFormat": legend}
            for i, (legend, query) in enumerate(queries.items())
        ],
    }


def dashboard():
    """Returns the document that Grafana imports."""
    shown, y = [], 0
    for title, row in ROWS.items():
        shown.append(
            {
                "id": len(shown) + 1,
                "type": "row",
                "title": title,
                "panels": [],
                "collapsed": False,
                "gridPos": {"x": 0, "y": y, "w": WIDTH, "h": 1},
            }
        )
        y += 1
        width, height = (6, 4) if title == "At a glance" else (8, HEIGHT)
        for i, panel in enumerate(row):
            line, column = divmod(i, WIDTH // width)
            place = {"x": column * width, "y": y + line * height, "w": width, "h": height}
            shown.append(panel_json(len(shown) + 1, panel, place))
        y += -(-len(row) * width // WIDTH) * height
    query = "label_values(gramian_build_info, instance)"
    return {
        "uid": "gramian",
        "title": "gramian",
        "tags": ["gramian"],
        "schemaVersion": 38,
        "timezone": "browser",
        "refresh": "30s",
        "time": {"from": "now-1h", "to": "now"},
        "templating": {
            "list": [
                {"name": "datasource", "type": "datasource", "query": "prometheus"},
                {
                    "name": "instance",
                    "type": "query",
                    "query": query,
                    "refresh": 2,
                    "includeAll": True,
                    "multi": True,
                    "allValue": ".*",
                    "current": {"text": "All", "value": "$__all"},
                    "datasource": {"type": "prometheus", "uid": "${datasource}"},
                },
            ]
        },
        "panels": shown,
    }


def main():
    text = json.dumps(dashboard(), indent=2, ensure_ascii=False) + "\n"
    if sys.argv[1:] == ["--check"]:
        is_current = FILE.exists() and FILE.read_text() == text
        sys.exit(0 if is_current else "dashboard.json is old: run deploy/grafana/dashboard.py")
    FILE.write_text(text)


if __name__ == "__main__":
    main()
