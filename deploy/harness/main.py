"""Runs all the tests of deploy/test, which describes them."""

import shutil
import signal
import sys

import chart
import observed
from fleet import Envoy, Fleet, Haproxy, Nginx
from phases import Report, deadly, hit_rate, kill, leave, refusing_store, rolling_restart, running, silent_store, smoke
from processes import Failed, Processes


def main(binary):
    # When this program is ended, it ends all that it started. Both signals are set explicitly: a shell makes
    # programs in its background ignore SIGINT.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit("ended"))
    report, processes = Report(), Processes()
    try:
        run(report, processes, binary)
    except Failed as failure:
        report.line("cannot go on", failure, False)
    finally:
        processes.end_all()
        if report.n_missed:
            print("\n".join(processes.last_words()))
        shutil.rmtree(processes.directory, ignore_errors=True)
    print("all bounds hold" if not report.n_missed else f"{report.n_missed} bounds are missed")
    sys.exit(bool(report.n_missed))


def run(report, processes, binary):
    """Runs all phases."""
    chart.check(report)
    fleet = Fleet(processes, binary)
    prometheus = observed.Prometheus(fleet)
    fleet.start()
    prometheus.start()
    with running(fleet, Haproxy(fleet)) as router:
        behind(report, fleet, router)
        observed.dashboard(report, prometheus)
        observed.alerts(report, prometheus)
        refusing_store(report, fleet, router)
        silent_store(report, fleet, router)
    for router in (Nginx(fleet), Envoy(fleet)):
        with running(fleet, router):
            behind(report, fleet, router)


def behind(report, fleet, router):
    """Runs the phases that every router has to pass."""
    smoke(report, router)
    leave(report, fleet, router)
    hit_rate(report, fleet, router)
    kill(report, fleet, router)
    if router.counts_kept_connections:
        deadly(report, fleet, router)
    rolling_restart(report, fleet, router)


if __name__ == "__main__":
    main(sys.argv[1])
