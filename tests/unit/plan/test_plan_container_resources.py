"""The resources of containers: requests and limits of a job, defaults, and a standby's memory."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api.container import Resources
from palaestra.plan import ClusterLayout, Images, plan, resources
from tests.unit.plan.pod_containers import OWN, TWO_GROUPS, containers, environment


@pytest.mark.parametrize(
    ("wanted", "planned"),
    [
        ({}, {"requests": {"cpu": "1", "memory": "1Gi"}, "limits": {"cpu": "2"}}),
        ({"limits": {"cpu": "500m"}}, {"requests": {"memory": "1Gi"}, "limits": {"cpu": "500m"}}),
        (
            {"requests": {"cpu": "8"}},
            {"requests": {"memory": "1Gi", "cpu": "8"}, "limits": {"cpu": "8"}},
        ),
        (
            {"requests": {"cpu": "1500m"}, "limits": {"cpu": "3"}},
            {"requests": {"memory": "1Gi", "cpu": "1500m"}, "limits": {"cpu": "3"}},
        ),
    ],
)
def test_a_default_never_contradicts_what_a_job_asks_for(wanted, planned):
    """The API server rejects a request above its limit. So a default limit must not be below a request."""
    default = Resources(requests={"cpu": "1", "memory": "1Gi"}, limits={"cpu": "2"})

    assert resources.resources(Resources(**wanted), default) == planned


@pytest.mark.parametrize(
    ("requested", "limit"),
    [
        pytest.param("1Gi", "2Gi", id="less than the default"),
        pytest.param("2048Mi", "2Gi", id="as much in another unit"),
        pytest.param("3G", "3G", id="more"),
    ],
)
@pytest.mark.parametrize("container", ["trainer", "sim-collect-0"])
def test_a_request_for_memory_takes_no_limit_away(in_cluster, container, requested, limit):
    """Without a limit the container could use all memory of its node.

    The kernel would then kill pods of other users.
    """
    wanted = {"resources": {"requests": {"memory": requested}}}
    group = {"name": "collect", "role": "Collect"} | (wanted if container != "trainer" else {})
    trainer = {"evaluation": {"everySteps": 0}} | (wanted if container == "trainer" else {})

    planned = containers(in_cluster(simulators=[group], trainer=trainer))[container]["resources"]

    assert (planned["requests"]["memory"], planned["limits"]["memory"]) == (requested, limit)


def test_every_container_has_a_limit_of_its_memory(in_cluster):
    """A job that sets only requests still gets a memory limit on each container."""
    requests = {"resources": {"requests": {"memory": "1Gi", "cpu": "2"}}}
    groups = [{**group, **requests} for group in TWO_GROUPS]

    planned = containers(in_cluster(simulators=groups, trainer=requests))

    assert all("memory" in each["resources"]["limits"] for each in planned.values())


STANDBY = [{"name": "collect", "role": "Collect", "standby": True}, {"name": "evaluate", "role": "Evaluate"}]


def test_a_sidecar_gets_an_option_for_a_second_simulator_that_stands_by(in_cluster):
    """With `--standby` the sidecar generates a second world from the same source, with its own ROS names."""
    planned = containers(in_cluster(simulators=STANDBY))

    assert "--standby" in planned["sim-collect-0"]["args"]
    assert "--standby" not in planned["sim-evaluate-0"]["args"]


def test_a_simulator_that_stands_by_has_memory_of_its_own_and_shares_the_processor(in_cluster):
    """The container runs two simulators, so it needs the memory of both.

    The processor is not doubled, because only one of them computes at a time.
    """
    one, two = (
        containers(in_cluster(simulators=simulators))["sim-collect-0"]["resources"]
        for simulators in (TWO_GROUPS, STANDBY)
    )

    assert one == {"requests": {"cpu": "75m", "memory": "160Mi"}, "limits": {"memory": "2Gi"}}
    assert two == {"requests": {"cpu": "75m", "memory": "320Mi"}, "limits": {"memory": "4Gi"}}


def test_a_simulator_that_stands_by_has_shared_memory_of_its_own(in_cluster):
    """Webots keeps its camera images in this volume, which counts toward the memory of the container."""
    spec = in_cluster(simulators=STANDBY).replicas[0].job["spec"]["template"]["spec"]
    sizes = {
        volume["name"]: volume["emptyDir"]["sizeLimit"]
        for volume in spec["volumes"]
        if volume["name"].startswith("memory-sim-")
    }

    assert sizes == {"memory-sim-collect-0": "256Mi", "memory-sim-evaluate-0": "128Mi"}


@pytest.mark.parametrize(
    ("quantity", "doubled"),
    [("160Mi", "320Mi"), ("1.5Gi", "3Gi"), ("0.3G", "0.6G"), ("500m", "1000m"), ("5", "10"), ("100", "200")],
)
def test_a_quantity_is_doubled_in_its_own_unit(quantity, doubled):
    """Twice `1Gi` is `2Gi`, not a number of bytes, so a reader of the pod recognizes the job's value."""
    assert resources.twice(quantity) == doubled


@given(st.integers(min_value=1, max_value=200_000))
def test_there_is_always_a_thread_and_never_more_than_a_core_too_many(millis):
    """The number of threads is the CPU limit, rounded up: half a core gives one thread."""
    threads = resources.threads({"limits": {"cpu": f"{millis}m"}})

    assert threads >= 1
    assert 0 <= threads * 1000 - millis < 1000


@pytest.mark.parametrize(
    ("wanted", "size"),
    [
        ({"limits": {"memory": "6Gi"}}, "6Gi"),
        ({"limits": {"cpu": "2"}}, "2Gi"),
        ({"requests": {"memory": "3Gi"}}, "3Gi"),
    ],
)
def test_the_trainer_shares_memory_within_its_limit(in_cluster, wanted, size):
    """Workers of a DataLoader or AsyncVectorEnv need more than a container runtime's 64 MiB."""
    planned = in_cluster(trainer={"resources": wanted})
    volumes = planned.replicas[0].job["spec"]["template"]["spec"]["volumes"]
    mounts = {each["mountPath"]: each["name"] for each in containers(planned)["trainer"]["volumeMounts"]}

    [volume] = [each["emptyDir"] for each in volumes if each["name"] == mounts["/dev/shm"]]
    assert volume == {"medium": "Memory", "sizeLimit": size}


def test_a_job_sets_the_resources_of_the_ros_master(in_cluster):
    """A quota on `limits.cpu` rejects each pod in which a container has no CPU limit."""
    own = {"requests": {"cpu": "100m", "memory": "128Mi"}, "limits": {"cpu": "200m", "memory": "256Mi"}}

    planned = containers(in_cluster(simulators=[OWN, TWO_GROUPS[1]], rosMaster={"resources": own}))

    assert planned["ros-master"]["resources"] == own
    assert planned["install-sidecar"]["resources"] == own


def test_an_installation_sets_the_resources_of_jobs_that_mention_none(valid_job):
    """With these defaults a minimal job fits a namespace with a quota.

    A value in the job overrides a default.
    """
    defaults = resources.Defaults(
        ros_master=Resources(limits={"cpu": "200m"}),
        simulator=Resources(limits={"cpu": "1"}),
        trainer=Resources(limits={"cpu": "3", "memory": "4Gi"}),
    )
    layout = ClusterLayout(images=Images.of_release("1"), resources=defaults)
    job = valid_job(trainer={"resources": {"limits": {"memory": "1Gi"}}})

    planned = containers(plan(job, layout))

    assert planned["ros-master"]["resources"] == {
        "requests": {"memory": "64Mi"},
        "limits": {"memory": "256Mi", "cpu": "200m"},
    }
    assert planned["sim-collect-0"]["resources"]["limits"] == {"memory": "2Gi", "cpu": "1"}
    assert planned["trainer"]["resources"] == {"limits": {"cpu": "3", "memory": "1Gi"}}
    assert environment(planned["trainer"])["OMP_NUM_THREADS"] == "3"
