"""The containers of a pod: their order, ports, commands, environment and resources."""

import pytest
import yaml

from palaestra.local.pod_spec import read_pod
from palaestra.plan import Images, LocalLayout, plan
from tests.unit.plan.pod_containers import TWO_GROUPS, containers, environment


def test_the_ros_master_starts_first_and_the_trainer_last(in_cluster):
    """A kubelet starts native sidecars in the order of the list."""
    names = list(containers(in_cluster(simulators=TWO_GROUPS)))

    assert names == ["ros-master", "sim-collect-0", "sim-collect-1", "sim-evaluate-0", "trainer"]


def test_no_sidecar_of_a_simulator_has_a_startup_probe(in_cluster):
    """No trainer starts after a sidecar with a startup probe has failed once (Kubernetes issue 132826)."""
    probed = [name for name, each in containers(in_cluster()).items() if "startupProbe" in each]

    assert probed == ["ros-master", "trainer"]


@pytest.mark.parametrize(("spec", "seconds"), [({}, 21_600), ({"startTimeoutSeconds": 605}, 605)])
def test_a_start_may_take_as_long_as_the_first_step(in_cluster, spec, seconds):
    """On a busy node a trainer imports PyTorch for minutes.

    A startup probe of two minutes killed it every time.
    """
    planned = containers(in_cluster(**spec))

    for name in ("ros-master", "trainer"):
        probe = planned[name]["startupProbe"]
        each_s = max(probe["periodSeconds"], probe["timeoutSeconds"])
        assert 0 <= probe["failureThreshold"] * each_s - seconds < each_s
    assert "initialDelaySeconds" not in planned["trainer"]["livenessProbe"]


def test_a_start_on_a_laptop_has_ten_minutes(on_laptop):
    """A person waits for a local run, so a ROS master that hangs must not hold the terminal for six hours."""
    planned = containers(on_laptop())

    assert planned["ros-master"]["startupProbe"]["failureThreshold"] == 60
    assert planned["trainer"]["startupProbe"]["failureThreshold"] == 60


@pytest.mark.parametrize(("deadline", "timeout", "delay"), [(300, 21_600, 300), (300, 60, 60)])
def test_a_sidecar_may_start_as_long_as_its_simulator(in_cluster, deadline, timeout, delay):
    """The liveness probe waits as long as a start may take.

    After that, the trainer counts the start as failed.
    """
    groups = [{**group, "startDeadlineSeconds": deadline} for group in TWO_GROUPS]
    planned = containers(in_cluster(simulators=groups, startTimeoutSeconds=timeout))

    assert planned["sim-collect-0"]["livenessProbe"]["initialDelaySeconds"] == delay


def test_sidecars_are_restarted_and_the_trainer_is_not(in_cluster):
    """A trainer restarts in a new pod, which the Job controller creates."""
    policies = {name: each.get("restartPolicy") for name, each in containers(in_cluster()).items()}

    assert policies.pop("trainer") is None
    assert set(policies.values()) == {"Always"}


def test_the_ports_of_simulators_count_up(in_cluster):
    """The containers of a pod share one network, so each simulator needs its own ports."""
    planned = containers(in_cluster(simulators=TWO_GROUPS))
    arguments = [" ".join(planned[name]["args"]) for name in planned if name.startswith("sim-")]

    for place, text in enumerate(arguments):
        assert f"--control=127.0.0.1:{7100 + place} --health=0.0.0.0:{7200 + place}" in text


def test_one_simulator_of_a_replica_keeps_the_clock(in_cluster):
    """If two simulators published `/clock`, their subscribers would read two times on one topic."""
    planned = containers(in_cluster(simulators=TWO_GROUPS))

    assert [name for name, each in planned.items() if "--clock" in each.get("args", ())] == ["sim-collect-0"]


def test_control_ports_are_on_loopback_only(in_cluster):
    """ROS and the control ports of sidecars have no authentication, so other pods must not reach them."""
    for container in containers(in_cluster()).values():
        assert not any(
            arg.startswith("--control=") and "127.0.0.1" not in arg for arg in container.get("args", ())
        )


def test_every_container_knows_master_configuration_run_and_pod(in_cluster):
    """Without these variables, a program finds neither the ROS master nor the training.yaml of its run."""
    for container in containers(in_cluster()).values():
        variables = environment(container)
        assert variables["ROS_MASTER_URI"] == "http://127.0.0.1:11311"
        assert variables["ROS_HOSTNAME"] == "localhost"
        assert variables["PALAESTRA_CONFIG"] == "/etc/palaestra/training.yaml"
        assert variables["PALAESTRA_POD_UID"] == {"fieldRef": {"fieldPath": "metadata.uid"}}
        assert variables["OMP_NUM_THREADS"] == "1"


def test_threads_follow_the_cpu_limit(in_cluster):
    """PyTorch would start a thread for each core of the node, and the threads would compete for the limit."""
    trainer = containers(in_cluster(trainer={"resources": {"limits": {"cpu": "3500m"}}}))["trainer"]

    assert environment(trainer)["OMP_NUM_THREADS"] == "4"


def test_variables_of_the_job_win_and_stand_once(in_cluster):
    """Server-side apply rejects a list in which a variable's name occurs twice."""
    env = [
        {"name": "OMP_NUM_THREADS", "value": "2"},
        {"name": "TOKEN", "secretKeyRef": {"name": "hub", "key": "token"}},
    ]
    trainer = containers(in_cluster(trainer={"env": env}))["trainer"]
    names = [each["name"] for each in trainer["env"]]

    assert len(names) == len(set(names))
    assert environment(trainer)["OMP_NUM_THREADS"] == "2"
    assert environment(trainer)["TOKEN"] == {"secretKeyRef": {"name": "hub", "key": "token"}}


def test_two_replicas_of_two_simulators_fit_on_two_cores_with_the_operator(in_cluster):
    """A cluster on a laptop may have only two cores, so one replica requests at most 450m."""
    requests = [each["resources"]["requests"]["cpu"] for each in containers(in_cluster()).values()]

    assert sum(int(cpu.removesuffix("m")) for cpu in requests) <= 450


def test_the_jobs_own_program_replaces_the_loop_and_need_not_serve_health(in_cluster):
    """A trainer program of twenty lines has no web server, so its container has no health probe."""
    trainer = containers(in_cluster(trainer={"command": ["python", "mine.py"]}))["trainer"]

    assert trainer["command"] == ["python", "mine.py"]
    assert not {"livenessProbe", "startupProbe"} & set(trainer)


def test_images_are_the_jobs_or_the_releases(in_cluster):
    """A job names an image only if it replaces the image of the release."""
    simulators = [
        {"name": "a", "role": "Collect", "driver": "webots"},
        {"name": "b", "role": "Evaluate", "image": "mine:2"},
    ]
    planned = containers(in_cluster(simulators=simulators))

    assert planned["sim-a-0"]["image"] == "webots:1"
    assert planned["sim-b-0"]["image"] == "mine:2"
    assert planned["trainer"]["image"] == planned["ros-master"]["image"] == "trainer:1"


def test_mujoco_has_its_image_its_driver_and_memory_for_a_camera(in_cluster):
    """A simulator with a renderer needs 200 MB, and its container runs the sidecar too."""
    mujoco = {"name": "a", "role": "Collect", "driver": "mujoco", "options": ["--leave-out", "all"]}

    planned = containers(in_cluster(simulators=[mujoco, {"name": "b", "role": "Evaluate"}]))

    assert planned["sim-a-0"]["image"] == "mujoco:1"
    assert planned["sim-b-0"]["image"] == "stub:1"
    assert planned["sim-a-0"]["args"][0] == "--driver=mujoco"
    assert planned["sim-a-0"]["args"][-2:] == ["--option=--leave-out", "--option=all"]
    assert planned["sim-a-0"]["resources"]["requests"] == {"cpu": "75m", "memory": "256Mi"}


def test_the_memory_that_a_job_asks_for_takes_the_place_of_mujoco_s(in_cluster):
    """A world of many meshes needs more memory than MuJoCo's default."""
    mujoco = {
        "name": "a",
        "role": "Collect",
        "driver": "mujoco",
        "resources": {"requests": {"memory": "1Gi"}},
    }

    planned = containers(in_cluster(simulators=[mujoco], trainer={"evaluation": {"everySteps": 0}}))

    assert planned["sim-a-0"]["resources"] == {
        "requests": {"cpu": "75m", "memory": "1Gi"},
        "limits": {"memory": "2Gi"},
    }


COMMAND = [
    {"name": "own", "role": "Collect", "driver": "command", "image": "my:1", "command": ["sim", "{world}"]},
    {"name": "evaluate", "role": "Evaluate"},
]


OF_POD = "$(PALAESTRA_POD_UID)"


@pytest.mark.parametrize("where", ["in_cluster", "on_laptop"])
def test_no_text_of_a_job_becomes_the_value_of_a_variable(request, where):
    """A kubelet expands `$(NAME)` in commands, arguments and values.

    A job's text must not become the value of a variable that it did not set.
    """
    env = [{"name": "OWN", "value": OF_POD}]
    own = {
        "name": "own",
        "role": "Collect",
        "driver": "command",
        "image": "my:1",
        "command": ["sim", OF_POD],
        "options": [OF_POD],
        "world": {"file": f"/worlds/{OF_POD}/worlds/hall.wbt", "root": f"/worlds/{OF_POD}"},
        "env": env,
    }
    job = {"simulators": [own], "trainer": {"command": ["python", OF_POD], "env": env}}
    job["trainer"]["evaluation"] = {"everySteps": 0}

    planned = containers(request.getfixturevalue(where)(**job))

    texts = [
        text
        for each in planned.values()
        for text in (
            *each["command"],
            *each.get("args", ()),
            *(one.get("value", "") for one in each.get("env", ())),
        )
    ]
    assert sum(OF_POD in text for text in texts) == 7
    assert not [text for text in texts if OF_POD in text.replace("$$", "")]


def test_a_run_directory_may_have_a_dollar_in_its_name(valid_job):
    """The plan writes a dollar sign as `$$`. Both the kubelet and the local runner read `$$` as one `$`."""
    layout = LocalLayout(images=Images.of_release("1"), job_directory="/runs/$(id)$$/job")
    replica = plan(valid_job(), layout).replicas[0]
    pod = read_pod(replica.job["spec"]["template"], "uid")

    paths = [*pod.init[1].command, *pod.main.env.values()]

    assert [text for text in paths if "$(id)$$/job" in text]
    assert not [text for text in paths if "$(id)$/job" in text or "$$(id)" in text]


def test_a_program_of_the_users_gets_the_sidecar_copied_into_its_image(in_cluster):
    """A user's image for the driver `command` need not contain Palaestra.

    An init container copies the sidecar into a volume.
    """
    planned = containers(in_cluster(simulators=COMMAND))

    assert next(iter(planned)) == "install-sidecar"
    assert planned["sim-own-0"]["command"] == ["/palaestra/palaestra-sidecar"]
    assert planned["sim-own-0"]["args"][-3:] == ["--", "sim", "{world}"]
    assert planned["sim-evaluate-0"]["command"] == ["palaestra-sidecar"]


def test_the_copied_sidecar_is_where_the_users_image_starts_it(in_cluster):
    """The init container writes the sidecar into a volume, from which the simulators start it."""
    planned = containers(in_cluster(simulators=COMMAND))
    copied = {"name": "sidecar", "mountPath": "/palaestra"}

    assert planned["install-sidecar"]["volumeMounts"] == [copied]
    assert planned["install-sidecar"]["command"][-1].endswith(" /palaestra/")
    assert planned["install-sidecar"]["terminationMessagePolicy"] == "FallbackToLogsOnError"
    assert {**copied, "readOnly": True} in planned["sim-own-0"]["volumeMounts"]
    assert copied["name"] not in [mount["name"] for mount in planned["sim-evaluate-0"]["volumeMounts"]]


def test_ros_writes_its_logs_into_a_folder_that_is_there(in_cluster, on_laptop):
    """ROS would create a missing folder with the owner of its parent, and root owns the volume of a pod."""
    for planned in (containers(in_cluster()), containers(on_laptop())):
        for container in planned.values():
            mounted = [mount["mountPath"] for mount in container["volumeMounts"]]
            assert environment(container)["ROS_LOG_DIR"] in mounted


def test_on_a_laptop_nothing_is_copied(on_laptop):
    """On a laptop the sidecar is installed together with the runner, so no init container copies it."""
    planned = containers(on_laptop(simulators=COMMAND))

    assert "install-sidecar" not in planned
    assert planned["sim-own-0"]["command"] == ["palaestra-sidecar"]


def test_on_a_laptop_everything_lies_in_the_run_directory_and_on_loopback(on_laptop):
    """A local run must not write files outside its run directory on a person's machine."""
    replica = on_laptop().replicas[0]
    planned = containers(on_laptop())
    mounts = [mount["mountPath"] for each in planned.values() for mount in each["volumeMounts"]]
    training = yaml.safe_load(replica.config_map["data"]["training.yaml"])

    assert all(path == "/runs/job/0" or path.startswith("/runs/job/0/") for path in mounts)
    assert training["statusAddress"] == "127.0.0.1:4001"
    assert [each["control"] for each in training["simulators"]] == [
        "http://127.0.0.1:4100",
        "http://127.0.0.1:4101",
    ]
    assert "0.0.0.0" not in str(replica.job)
