"""The worlds of a replica are checked once and stored once per group; only sidecars put in the ROS names."""

import sys
from itertools import chain
from pathlib import PurePath

import pytest
import yaml

from palaestra.plan import ClusterLayout, Images, PlanError, plan
from palaestra.plan.worlds import MOST_BYTES
from palaestra_sim.sidecar.options import parse as read_options
from palaestra_sim.world import RunIdentity, WorldError, builtin, generate, parse, robots

LAYOUT = ClusterLayout(images=Images.of_release("1"))
ARENA = builtin("arena").decode()


def group(name="collect", role="Collect", **fields):
    """Return a group of simulators as a job's spec has it."""
    return {"name": name, "role": role, **fields}


EVALUATE = group("evaluate", "Evaluate")


def data(planned, replica=0):
    """Return the data of a replica's ConfigMap."""
    return planned.replicas[replica].config_map["data"]


def training(planned, replica=0):
    """Return a replica's training.yaml."""
    return yaml.safe_load(data(planned, replica)["training.yaml"])


def sidecars(planned, replica=0):
    """Return the containers of a replica that generate a world."""
    containers = planned.replicas[replica].job["spec"]["template"]["spec"]["initContainers"]
    return [each for each in containers if each["name"].startswith("sim-")]


def named(planned, replica=0):
    """Return the worlds of a replica's simulators by container, as their sidecars generate them."""
    worlds = {}
    for container in sidecars(planned, replica):
        given = read_options(container["args"])
        identity = RunIdentity(
            job=given.job,
            namespace=given.namespace,
            uid=given.uid,
            replica=given.replica,
            group=given.group,
            index=given.index,
        )
        source = data(planned, replica)[PurePath(given.world).name].encode()
        worlds[container["name"]] = generate(source, identity, clock=given.clock).decode()
    return worlds


def calls_of(function, work):
    """Return the number of times that `work()` calls a function."""
    calls = []

    def note(frame, event, _):
        if event == "call" and frame.f_code is function.__code__:
            calls.append(event)

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return len(calls)


def test_every_simulator_of_every_replica_has_ros_names_of_its_own(in_cluster):
    """Two simulators with equal ROS names would unregister each other from their ROS master."""
    planned = in_cluster(replicas=2, simulators=[group(count=3), EVALUATE])
    worlds = chain(*(named(planned, replica).values() for replica in range(2)))
    names = [robot.ros_name for world in worlds for robot in robots(world.encode())]

    assert len(names) == len(set(names)) == 8


def test_a_world_is_shipped_once_a_group_as_it_was_written(in_cluster):
    """Seventeen copies with names would take seventeen times the bytes, in etcd and on the network."""
    world = {"inline": ARENA}
    planned = in_cluster(simulators=[group(count=16, world=world), group("evaluate", "Evaluate")])

    assert data(planned).keys() == {"training.yaml", "collect.wbt", "evaluate.wbt"}
    assert data(planned)["collect.wbt"] == ARENA


def test_a_world_is_parsed_once_for_all_simulators_of_all_replicas(valid_job):
    """With one parse per simulator, thirty replicas of seventeen took fifteen seconds per reconcile."""
    world = {"inline": ARENA}
    job = valid_job(replicas=3, simulators=[group(count=4, world=world), EVALUATE | {"world": world}])

    assert calls_of(parse, lambda: plan(job, LAYOUT)) == 1


def test_a_world_that_ships_is_not_parsed(valid_job):
    """Tests of this project check the built-in worlds, so the plan need not parse them.

    Parsing takes most of the time of planning a small job.
    """
    assert calls_of(parse, lambda: plan(valid_job(simulators=[group(), EVALUATE]), LAYOUT)) == 0


def test_only_the_replicas_that_are_asked_for_are_planned(valid_job):
    """If one of a hundred replicas lacks an object, the operator plans only that replica."""
    planned = plan(valid_job(replicas=3), LAYOUT, replicas=[1])

    assert planned.replicas.keys() == {1}
    assert planned.replicas[1] == plan(valid_job(replicas=3), LAYOUT).replicas[1]


def test_the_trainer_and_the_sidecar_get_the_same_world(in_cluster):
    """The trainer reads the world's path from training.yaml, and the sidecar gets the path as an option.

    Both must name the same file.
    """
    planned = in_cluster()
    told = [each["world"] for each in training(planned)["simulators"]]

    assert told == ["/etc/palaestra/worlds/collect.wbt", "/etc/palaestra/worlds/evaluate.wbt"]
    for world, sidecar in zip(told, sidecars(planned), strict=True):
        assert f"--world={world}" in sidecar["args"]


def test_a_file_is_left_to_the_sidecar(in_cluster):
    """The plan cannot read this file.

    The file is in the simulator's image, with the files to which it refers.
    """
    planned = in_cluster(simulators=[group(world={"file": "/worlds/my.wbt"}), EVALUATE])

    assert "collect.wbt" not in data(planned)
    assert training(planned)["simulators"][0]["world"] == "/worlds/my.wbt"


def test_a_config_map_is_given_by_who_can_read_it(valid_job):
    """The plan is pure and reads nothing from the cluster, so its caller passes the content."""
    source = {"configMap": {"name": "worlds", "key": "a.wbt"}}
    job = valid_job(simulators=[group(world=source), EVALUATE])

    planned = plan(job, LAYOUT, {("worlds", "a.wbt"): ARENA.encode()})

    assert data(planned)["collect.wbt"] == ARENA
    with pytest.raises(PlanError, match=r"spec\.simulators\[0\]\.world\.configMap: .* a.wbt .* worlds "):
        plan(job, LAYOUT)


def test_the_error_for_a_broken_world_has_field_line_and_column(in_cluster):
    """The author of a job must find the position in the world's text."""
    broken = ARENA.replace("basicTimeStep 32", "basicTimeStep {")

    with pytest.raises(WorldError, match=r"^spec\.simulators\[0\]\.world\.inline:\d+:\d+: .*;"):
        in_cluster(simulators=[group(world={"inline": broken}), EVALUATE])


def test_a_world_that_no_sidecar_could_name_is_refused_before_anything_is_created(in_cluster):
    """A person sees a rejection at once, but may notice a failed start of a simulator only hours later."""
    twice = '#VRML_SIM R2023b utf8\nRobot { controller "ros" }\nRobot { controller "ros" }\n'

    with pytest.raises(WorldError, match=r'^spec\.simulators\[1\]\.world\.inline:3:1: .* called "robot"'):
        in_cluster(simulators=[group(), group("evaluate", "Evaluate", world={"inline": twice})])


def test_worlds_that_fit_nowhere_are_refused(valid_job):
    """A ConfigMap has a size limit. As the remedy, the message names images, which can hold larger worlds."""
    source = {"configMap": {"name": "worlds", "key": "a.wbt"}}
    huge = ARENA.encode() + b"# " + b"x" * MOST_BYTES
    job = valid_job(simulators=[group(world=source), EVALUATE])

    with pytest.raises(PlanError, match=r"put the worlds into the images"):
        plan(job, LAYOUT, {("worlds", "a.wbt"): huge})


def test_what_is_switched_off_is_absent(in_cluster):
    """`afterResets: 0` means never, and the trainer reads an absent field as never."""
    planned = in_cluster(simulators=[group(recycle={"afterResets": 0}), EVALUATE])

    assert "recycle" not in training(planned)["simulators"][0]
    assert "command" not in training(planned)


MODEL = '<mujoco model="arm"><actuator><motor joint="x"/></actuator></mujoco>'


def test_a_model_of_mujoco_is_a_file_that_ends_with_xml(in_cluster):
    """A sidecar writes the ROS names into a model of MuJoCo, as into a world of Webots."""
    planned = in_cluster(simulators=[group(driver="mujoco", world={"inline": MODEL}), EVALUATE])

    assert data(planned)["collect.xml"] == MODEL
    assert sidecars(planned)[0]["args"][:2][-1].endswith("/worlds/collect.xml")
    assert "--name=" in named(planned)["sim-collect-0"]


@pytest.mark.parametrize("world", [{"inline": MODEL}, {"file": "/robots/arm.xml"}])
def test_a_model_of_mujoco_needs_a_driver_that_reads_it(in_cluster, world):
    """The stub would reject the model at each of its starts."""
    with pytest.raises(
        PlanError, match=r"spec\.simulators\[0\]\.driver: stub cannot load the world.*set driver mujoco"
    ):
        in_cluster(simulators=[group(world=world), EVALUATE])
