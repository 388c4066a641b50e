"""The training move-to-target from `kubectl apply` to a policy, and a job with two replicas."""

import json
from datetime import datetime
from pathlib import PurePath

import pytest
import yaml

from palaestra_sim.world import RunIdentity, robots, ros_name
from tests.e2e.long_run import KILLS, NAME, PAIR, PAIR_STEPS, REPLICAS, STEPS
from tests.e2e.namespace import LONG_S, named

pytestmark = pytest.mark.timeout(1200)


def ros_names(content):
    """Yield the names of a replica's robots, which its sidecars write into the source worlds."""
    training = yaml.safe_load(content["training.yaml"])
    job = {field: training[field] for field in ("job", "namespace", "uid", "replica")}
    for simulator in training["simulators"]:
        identity = RunIdentity(**job, group=simulator["group"], index=simulator["index"])
        source = content[PurePath(simulator["world"]).name]
        yield from (f"/{ros_name(identity, robot.robot)}" for robot in robots(source.encode()))


def test_every_robot_of_all_pods_has_a_ros_name_of_its_own(long_run):
    """With the same ROS names in each simulator, only one simulator of a world could run at a time.

    The paper reports this limitation of its own architecture.
    """
    known = {named(pod): set() for pod in long_run.pods()}
    space = long_run.namespace
    generated = [name for each in space.select("configmaps", PAIR) for name in ros_names(each["data"])]
    assert len(generated) == len(set(generated)) == REPLICAS * 2

    def all_known():
        for pod, names in known.items():
            names.update(node for node in space.ros_nodes(pod) if "robotino" in node)
        return sum(map(len, known.values())) >= len(generated)

    space.wait(all_known, LONG_S)  # a simulator restarts between episodes, so not all names exist at once
    first, second = known.values()
    assert first.isdisjoint(second)
    assert first | second == set(generated)


def test_metrics_are_scraped_from_every_trainer_and_sidecar(long_run, monitor):
    """Prometheus in the monitoring namespace must reach every metrics port over the pod network."""
    for pod in long_run.pods():
        containers = [*pod["spec"]["initContainers"], *pod["spec"]["containers"]]
        ports = {p["name"]: p["containerPort"] for each in containers for p in each.get("ports", [])}
        scraped = {name: monitor.get(pod, port, "/metrics") for name, port in ports.items()}

        assert scraped.keys() == {"metrics", "sim-0", "sim-1"}
        assert "palaestra_trainer_steps_total " in scraped["metrics"]
        assert 'palaestra_simulator_state{slot="a",state="ready"}' in scraped["sim-0"]
        assert "palaestra_simulator_starts_total" in scraped["sim-1"]


def test_the_status_tells_where_each_replica_stands(long_run):
    """The long run's operator is killed repeatedly.

    Each new operator must get the progress from the trainers again.
    """
    long_run.pods()
    space = long_run.namespace

    def told():
        replicas = space.status(PAIR).get("replicas", [])
        return replicas if len(replicas) == REPLICAS and all(each.get("step") for each in replicas) else []

    for replica in space.wait(told, LONG_S):
        assert replica["phase"] == "Running"
        assert replica["target"] == PAIR_STEPS
        assert {each["name"]: each["role"] for each in replica["simulators"]} == {
            "collect-0": "Collect",
            "evaluate-0": "Evaluate",
        }


@pytest.mark.after_the_long_run
def test_every_replica_trains_to_the_end_though_the_operator_is_killed_ten_times(long_run):
    """If the operator is killed at random times, the pods of its jobs continue.

    Each replica has one pod, one attempt and a complete training.
    """
    ends = {name: long_run.end(name) for name in (NAME, PAIR)}
    space = long_run.namespace

    assert ends[NAME]["successRate"] >= 0.9
    assert len(long_run.kills) == KILLS
    made = space.get("trainingjobs", PAIR)["metadata"]["creationTimestamp"]
    begun, ended = (datetime.fromisoformat(each) for each in (made, ends[PAIR]["completionTime"]))
    assert begun < min(long_run.kills) < max(long_run.kills) < ended, "killed when there was nothing to do"
    for name, replicas, steps in ((NAME, 1, STEPS), (PAIR, REPLICAS, PAIR_STEPS)):
        assert ends[name]["phase"] == "Succeeded", ends[name]
        assert ends[name]["running"] == f"{replicas}/{replicas}"
        for replica in ends[name]["replicas"]:
            assert replica["phase"] == "Succeeded"
            assert replica["attempt"] == 1
            assert replica["step"] == replica["lastCheckpoint"]["step"] == steps
            assert replica["restarts"]["trainer"] == replica["restarts"]["disruption"] == 0
        assert len(space.pods(name, live=False)) == space.pods_made(name) == replicas
        assert space.holds(name, "Succeeded")
        assert not space.holds(name, "Running")


@pytest.mark.after_the_long_run
def test_the_last_word_of_a_trainer_is_in_its_pod(long_run):
    """The trainer writes its result as the termination message, so the operator needs no poll at the end."""
    long_run.end(PAIR)

    for pod in long_run.namespace.pods(PAIR, live=False):
        ended = pod["status"]["containerStatuses"][0]["state"]["terminated"]
        assert ended["exitCode"] == 0
        assert json.loads(ended["message"])["step"] == PAIR_STEPS


@pytest.mark.after_the_long_run
@pytest.mark.parametrize(("name", "replicas", "steps"), [(NAME, "1/1", "25000"), (PAIR, "2/2", "3000")])
def test_kubectl_shows_a_job_in_one_line(long_run, name, replicas, steps):
    """A person looks first at status, reason, replicas, step and success, so one line must show them."""
    status = long_run.end(name)
    cluster, space = long_run.namespace.cluster, long_run.namespace

    header, line = cluster.kubectl("get", "tj", name, "-n", space.name).splitlines()

    assert header.split() == ["NAME", "STATUS", "REASON", "REPLICAS", "STEP", "TARGET", "SUCCESS", "AGE"]
    assert line.split()[:6] == [name, "Succeeded", "Succeeded", replicas, steps, steps]
    assert float(line.split()[6]) == pytest.approx(status["successRate"])


@pytest.mark.after_the_long_run
def test_what_was_run_stands_in_the_config_maps(long_run):
    """After the end of a run, a person must still be able to read its resolved job and its worlds."""
    long_run.end(PAIR)
    contents = long_run.namespace.select("configmaps", PAIR)

    seeds = {yaml.safe_load(each["data"]["training.yaml"])["seed"] for each in contents}
    assert seeds == {1, 2}
    assert all(each["immutable"] for each in contents)
