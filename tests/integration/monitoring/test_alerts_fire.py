"""Every alert fires and clears, with simulated time in promtool and in a real Prometheus.

promtool tests long times: how long a problem must last before its alert fires, and when the two alerts clear
that consider the last minutes.
"""

import signal
import subprocess
from pathlib import Path

import pytest
import yaml

from tests.control_plane.programs import programs
from tests.integration.monitoring.life import address, diverge
from tests.local_run import LocalRun, send
from tests.monitoring import targets
from tests.monitoring.prometheus import PROGRAMS, scraping
from tests.monitoring.questions import ALERTS, alerts
from tests.soak.jobs import LITTLE_PPO, tiny_job

pytestmark = pytest.mark.minutes(2)

CASES = Path(__file__).with_name("alerts.test.yaml")
DEADLINE_S = 90
# The simulators are slower than real time, and a checkpoint is due six times per rollout.
SICK = {
    "collect": {"restart": {"limit": 4, "withinSeconds": 60}},
    "faults": "slow:latency_ms=250",
    "algorithm": LITTLE_PPO | {"hyperparameters": {"n_steps": 64, "batch_size": 32}},
    "steps": 100_000,
    "evaluation": {"everySteps": 0},
    "checkpoint": {"everySteps": 10, "keep": 2},
}


@pytest.fixture
def rules(tmp_path):
    """Write the alerts without their waiting times, and return the file."""
    content = yaml.safe_load(ALERTS.read_text())
    for group in content["groups"]:
        for rule in group["rules"]:
            rule.pop("for", None)
    file = tmp_path / "alerts.yaml"
    file.write_text(yaml.safe_dump(content))
    return file


@pytest.fixture
def folder(tmp_path):
    """Return an empty folder for Prometheus."""
    made = tmp_path / "prometheus"
    made.mkdir()
    return made


def test_the_alerts_are_rules_that_prometheus_reads_and_fire_and_clear_in_time():
    """The rules take minutes to fire, and promtool simulates that time."""
    promtool = programs(PROGRAMS) / "promtool"

    for command in (["check", "rules", ALERTS], ["test", "rules", CASES]):
        done = subprocess.run([promtool, *command], capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_no_alert_is_without_a_case_in_which_it_fires_and_one_in_which_it_does_not():
    """With only one of the two cases, an alert that always fires, or never fires, could pass."""
    cases = [case for test in yaml.safe_load(CASES.read_text())["tests"] for case in test["alert_rule_test"]]
    names = {rule["alert"] for rule in alerts()}

    assert {case["alertname"] for case in cases if case["exp_alerts"]} == names
    assert {case["alertname"] for case in cases if not case["exp_alerts"]} == names


def test_the_alerts_about_a_sick_run_fire_and_clear(tmp_path, folder, rules):
    """Each alert must fire for the problem that it names.

    The run's simulators are slow and later stopped, the run saves no checkpoint, and its restart budget runs
    out.
    """
    job = tiny_job(**SICK)
    job["spec"]["stallDeadlineSeconds"] = 30
    with LocalRun(tmp_path, job) as run, scraping(targets.of_run(run, "lab"), folder, rules) as prometheus:
        _fires(prometheus, "PalaestraSimulatorSlow")
        _fires_and_clears(prometheus, "PalaestraNoCheckpoint")

        for starts in (1, 2, 3):
            _waits_for(prometheus, f'palaestra_simulator_starts_total{{simulator="collect-0"}} >= {starts}')
            send(run.until(lambda: run.pids("palaestra-stub", "collect-0.wbt"))[0], signal.SIGKILL)
        _fires_and_clears(prometheus, "PalaestraFaultBudgetNearlySpent")

        stopped = [
            run.pid_of(program, "sim-collect-0/") for program in ("palaestra-sidecar", "palaestra-stub")
        ]
        for pid in stopped:  # the sidecar too, because it would restart the simulator
            send(pid, signal.SIGSTOP)
        _fires(prometheus, "PalaestraTrainingStalled")
        for pid in stopped:
            send(pid, signal.SIGCONT)
        _clears(prometheus, "PalaestraTrainingStalled")


def test_alerts_fire_without_a_leader_and_without_an_operator(folder, rules, place, start):
    """Prometheus scrapes only the second operator. It leads when the Lease of the killed operator expires."""
    first = start(elect=True)
    address(first)
    second = start(elect=True)
    with scraping([targets.of_operator(address(second))], folder, rules) as prometheus:
        _fires(prometheus, "PalaestraNoLeader")
        assert "PalaestraOperatorDown" not in _firing(prometheus)
        first.kill()
        _clears(prometheus, "PalaestraNoLeader")

        diverge(place)
        _fires(prometheus, "PalaestraDiverged")

        second.stop()
        _fires(prometheus, "PalaestraOperatorDown")


def _fires_and_clears(prometheus, alert):
    _fires(prometheus, alert)
    _clears(prometheus, alert)


def _fires(prometheus, alert):
    prometheus.until(lambda: alert in _firing(prometheus), DEADLINE_S)


def _clears(prometheus, alert):
    prometheus.until(lambda: alert not in _firing(prometheus), DEADLINE_S)


def _waits_for(prometheus, expr):
    prometheus.until(lambda: prometheus.query(expr), DEADLINE_S)


def _firing(prometheus):
    return {series["metric"]["alertname"] for series in prometheus.query('ALERTS{alertstate="firing"}')}
