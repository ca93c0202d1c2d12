"""Panels of the dashboard, in rows, with their Prometheus queries. dashboard.py writes them for Grafana.

deploy/test sends each query to a Prometheus that scrapes replicas under load.
"""

# $instance is the selection at the top of the dashboard.
SELECTED = 'job="gramian", instance=~"$instance"'


def rate(family, labels="", by=""):
    """Returns the query for a counter's rate per second, summed over all labels except those in `by`."""
    labels = f"{SELECTED}, {labels}" if labels else SELECTED
    return f"sum {f'by ({by}) ' if by else ''}(rate({family}{{{labels}}}[$__rate_interval]))"


def share(family, labels):
    """Returns the query for the share of a counter's rate that has these labels. 0 if there is none yet."""
    return f"({rate(family, labels)} or vector(0)) / {rate(family)}"


def quantile(level, by=""):
    """Returns the query for a quantile of the time of requests under /v1."""
    buckets = rate("gramian_http_request_duration_seconds_bucket", 'route=~"/v1/.*"', f"le{by and ', ' + by}")
    return f"histogram_quantile({level}, {buckets})"


def used(part):
    """Returns the query for the used share of a part of the memory."""
    suffix = f'_bytes{{{SELECTED}, part="{part}"}}'
    return f"gramian_memory_used{suffix} / gramian_memory_limit{suffix}"


def gauge(family, labels=""):
    """Returns the query for the current value of a gauge on each replica."""
    return f"{family}{{{SELECTED}{labels and ', ' + labels}}}"


# Panels by row. A panel is a title, a unit, queries by legend, and a description.
ROWS = {
    "At a glance": [
        ("Replicas up", "none", {"replicas": 'sum(up{job="gramian"})'}, "Of those that Prometheus knows."),
        ("Requests", "reqps", {"all": rate("gramian_http_requests_total")}, "Per second, probes included."),
        (
            "Cache hits",
            "percentunit",
            {"hits": share("gramian_cache_requests_total", 'outcome="hit"')},
            "Share of answers whose model was cached. Low if clients omit Gramian-Cloud or the cache is too small.",
        ),
        (
            "Server errors (5xx)",
            "percentunit",
            {"5xx": share("gramian_http_requests_total", 'status=~"5.."')},
            "503 is retried by the router and by clients.",
        ),
    ],
    "Requests": [
        (
            "By status",
            "reqps",
            {"{{status}}": rate("gramian_http_requests_total", by="status")},
            "499: the client disconnected before the answer.",
        ),
        ("By route", "reqps", {"{{route}}": rate("gramian_http_requests_total", 'route=~"/v1/.*"', "route")}, ""),
        (
            "Time of requests",
            "s",
            {"median": quantile(0.5), "p95": quantile(0.95), "p99": quantile(0.99)},
            "From the head of a request to the head of its answer, under /v1.",
        ),
        ("Time by route, p95", "s", {"{{route}}": quantile(0.95, "route")}, ""),
        ("Refusals by type", "reqps", {"{{type}}": rate("gramian_problems_total", by="type")}, ""),
        (
            "Rate-limited (429)",
            "reqps",
            {"{{instance}}": rate("gramian_rate_limited_total", by="instance")},
            "Requests beyond the limits of their key.",
        ),
    ],
    "Load": [
        (
            "Waiting",
            "none",
            {"{{instance}}": gauge("gramian_queue_depth")},
            "What the autoscaler looks at. One replica far above the others: one cloud has all the load.",
        ),
        ("Waiting by lane", "none", {"{{lane}}": f"sum by (lane) ({gauge('gramian_compute_waiting')})"}, ""),
        ("Running by lane", "none", {"{{lane}}": f"sum by (lane) ({gauge('gramian_compute_running')})"}, ""),
        (
            "Places taken",
            "percentunit",
            {"{{instance}}": f"{gauge('gramian_compute_admitted')} / {gauge('gramian_compute_places')}"},
            "At 100 % the next request is answered 503.",
        ),
        (
            "Jobs",
            "none",
            {"{{status}}": f"sum by (status) ({gauge('gramian_jobs')})"},
            "Requested with Prefer: respond-async. A replica runs as many at once as it has threads; others wait.",
        ),
        ("Requests in flight", "none", {"{{instance}}": gauge("gramian_http_requests_in_flight")}, ""),
        (
            "Cores in use",
            "none",
            {"{{instance}}": rate("process_cpu_seconds_total", by="instance")},
            "Beside the threads of each lane, gramian_compute_threads.",
        ),
    ],
    "Models and memory": [
        (
            "Answers by cache outcome",
            "reqps",
            {"{{outcome}}": rate("gramian_cache_requests_total", by="outcome")},
            "hit, miss, or collapsed: another request was computing the model.",
        ),
        ("Models prepared", "ops", {"{{kind}}": rate("gramian_solvers_prepared_total", by="kind")}, ""),
        (
            "Entries kept",
            "none",
            {"{{instance}} {{part}}": gauge("gramian_cache_entries")},
            "Clouds, and models (part `cache`).",
        ),
        (
            "Evicted",
            "ops",
            {"{{instance}} {{part}}": rate("gramian_cache_evictions_total", by="instance, part")},
            "Entries evicted to make room. If as many models are evicted as prepared, the cache is too small.",
        ),
        (
            "Memory by part",
            "percentunit",
            {f"{{{{instance}}}} {part}": used(part) for part in ("clouds", "cache", "work", "intake")},
            "Of its limit. clouds and cache fill and stay full; intake and work come and go.",
        ),
        ("Resident memory", "bytes", {"{{instance}}": gauge("process_resident_memory_bytes")}, ""),
    ],
    "Store and router": [
        (
            "Store: operations",
            "ops",
            {"{{operation}} {{outcome}}": rate("gramian_store_operations_total", by="operation, outcome")},
            "",
        ),
        (
            "Store: up to date",
            "none",
            {"{{instance}}": gauge("gramian_store_up_to_date")},
            "0: some acknowledged clouds are in memory only. Do not stop this replica.",
        ),
        (
            "Store: clouds",
            "none",
            {"{{instance}}": gauge("gramian_store_clouds")},
            "As each replica last counted, at most ten minutes ago.",
        ),
        ("Store: bytes", "bytes", {"{{instance}}": gauge("gramian_store_bytes")}, ""),
        (
            "Store: damaged objects",
            "none",
            {"{{instance}}": f"sum by (instance) (increase(gramian_store_damaged_total{{{SELECTED}}}[$__range]))"},
            "",
        ),
        (
            "Router: requests by replica",
            "reqps",
            {"{{server}}": "sum by (server) (rate(haproxy_server_http_responses_total[$__rate_interval]))"},
            "Even if there are many clouds and no single one has most of the load.",
        ),
        (
            "Router: sent again",
            "ops",
            {
                "to the same": "sum(rate(haproxy_server_retry_warnings_total[$__rate_interval]))",
                "to another": "sum(rate(haproxy_server_redispatch_warnings_total[$__rate_interval]))",
            },
            "Above 0 while a replica is replaced or full.",
        ),
        (
            "Router: replicas that are up",
            "none",
            {"{{instance}}": 'sum by (instance) (haproxy_server_status{proxy="by_cloud", state="UP"})'},
            "",
        ),
    ],
    "Processes": [
        (
            "Hours since the start",
            "h",
            {"{{instance}}": f"(time() - {gauge('process_start_time_seconds')}) / 3600"},
            "",
        ),
        ("Open files", "none", {"{{instance}}": gauge("process_open_fds")}, ""),
        ("Versions", "none", {"{{version}}": f"count by (version) ({gauge('gramian_build_info')})"}, ""),
    ],
}


def queries():
    """Returns all queries, each with the title of its panel."""
    return [(title, query) for row in ROWS.values() for title, _, queries, _ in row for query in queries.values()]
