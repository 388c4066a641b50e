"""The worlds of a replica: generated here where they can be, and each simulator's own."""

import pytest
import yaml

from palaestra.plan import ClusterLayout, Images, PlanError, plan
from palaestra.plan.worlds import MOST_BYTES
from palaestra_sim.world import WorldError, builtin, robots

LAYOUT = ClusterLayout(images=Images.of_release("1"))
ARENA = builtin("arena").decode()


def group(name="collect", role="Collect", **fields):
    """Return a group of simulators."""
    return {"name": name, "role": role, **fields}


EVALUATE = group("evaluate", "Evaluate")


def data(planned, replica=0):
    """Return the content of a replica's ConfigMap."""
    return planned.replicas[replica].config_map["data"]


def training(planned, replica=0):
    """Return a replica's training.yaml."""
    return yaml.safe_load(data(planned, replica)["training.yaml"])


def test_every_simulator_of_every_replica_has_ros_names_of_its_own(in_cluster):
    """The limit of one simulator a master is what Palaestra removes."""
    planned = in_cluster(replicas=2, simulators=[group(count=3), EVALUATE])
    names = [
        robot.ros_name
        for replica in range(2)
        for key, text in data(planned, replica).items()
        if key.endswith(".wbt")
        for robot in robots(text.encode())
    ]

    assert len(names) == len(set(names)) == 8


def test_the_trainer_and_the_sidecar_are_told_the_same_world(in_cluster):
    """training.yaml says where the world is that the simulator runs."""
    planned = in_cluster()
    told = [each["world"] for each in training(planned)["simulators"]]
    sidecars = planned.replicas[0].job["spec"]["template"]["spec"]["initContainers"][1:]

    assert told == ["/etc/palaestra/worlds/collect-0.wbt", "/etc/palaestra/worlds/evaluate-0.wbt"]
    for world, sidecar in zip(told, sidecars, strict=True):
        assert f"--world={world}" in sidecar["args"]


def test_an_inline_world_is_generated_here(in_cluster):
    """Anyone can read it in the ConfigMap."""
    planned = in_cluster(simulators=[group(world={"inline": ARENA}), EVALUATE])

    assert "--name=job_r0_collect_0a_robotino_" in data(planned)["collect-0.wbt"]


def test_a_file_is_left_to_the_sidecar(in_cluster):
    """It lies in the image, with what it refers to beside it."""
    planned = in_cluster(simulators=[group(world={"file": "/worlds/my.wbt"}), EVALUATE])

    assert "collect-0.wbt" not in data(planned)
    assert training(planned)["simulators"][0]["world"] == "/worlds/my.wbt"


def test_a_config_map_is_given_by_who_can_read_it(make_job):
    """The plan is pure: it reads no cluster."""
    source = {"configMap": {"name": "worlds", "key": "a.wbt"}}
    job = make_job(simulators=[group(world=source), EVALUATE])

    planned = plan(job, LAYOUT, {("worlds", "a.wbt"): ARENA.encode()})

    assert "collect-0.wbt" in data(planned)
    with pytest.raises(PlanError, match=r"spec\.simulators\[0\]\.world\.configMap: .* worlds .* a.wbt"):
        plan(job, LAYOUT)


def test_a_broken_world_is_told_with_its_field_line_and_column(in_cluster):
    """A person sees the world's text in the job, and has to find the place."""
    broken = ARENA.replace("basicTimeStep 32", "basicTimeStep {")

    with pytest.raises(WorldError, match=r"^spec\.simulators\[0\]\.world\.inline:\d+:\d+: .*;"):
        in_cluster(simulators=[group(world={"inline": broken}), EVALUATE])


def test_worlds_that_would_not_fit_go_in_once_and_are_copied_by_the_sidecars(in_cluster):
    """A ConfigMap holds a megabyte, and sixteen copies of a big world are more."""
    big = ARENA + "# " + "x" * (MOST_BYTES // 5)
    planned = in_cluster(simulators=[group(world={"inline": big}, count=8), EVALUATE])

    assert [key for key in data(planned) if key.endswith(".wbt")] == ["collect.wbt", "evaluate.wbt"]
    assert {each["world"] for each in training(planned)["simulators"][:8]} == {
        "/etc/palaestra/worlds/collect.wbt"
    }


def test_worlds_that_fit_nowhere_are_refused(make_job):
    """With what to do instead."""
    source = {"configMap": {"name": "worlds", "key": "a.wbt"}}
    huge = ARENA.encode() + b"# " + b"x" * MOST_BYTES
    job = make_job(simulators=[group(world=source), EVALUATE])

    with pytest.raises(PlanError, match=r"put the worlds into the images"):
        plan(job, LAYOUT, {("worlds", "a.wbt"): huge})


def test_what_is_switched_off_is_absent(in_cluster):
    """Zero resets mean never, and the trainer reads absence as never."""
    planned = in_cluster(simulators=[group(recycle={"afterResets": 0}), EVALUATE])

    assert "recycle" not in training(planned)["simulators"][0]
    assert "command" not in training(planned)
