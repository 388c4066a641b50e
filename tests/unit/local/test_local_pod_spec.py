"""`read_pod` reads a planned pod, so that `palaestra run` can start it on this machine."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api import validate
from palaestra.local.errors import RunRefused
from palaestra.local.output import as_seen
from palaestra.local.pod_spec import read_pod
from palaestra.plan import Images, LocalLayout, identified, plan

JOB = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": {"name": "a"}}


def template(**spec):
    """Return the pod template of a job in a laptop's layout."""
    layout = LocalLayout(images=Images.of_release("1"), job_directory="/runs/a")
    job = identified(validate({**JOB, "spec": spec}), "uid")
    return plan(job, layout).replicas[0].job["spec"]["template"]


def test_every_planned_container_is_read_in_order():
    """In a cluster the kubelet would start the same containers in the same order."""
    pod = read_pod(template(), "pod-1")

    assert [each.name for each in pod.containers] == [
        "ros-master",
        "sim-collect-0",
        "sim-evaluate-0",
        "trainer",
    ]
    assert [each.sidecar for each in pod.containers] == [True, True, True, False]
    assert pod.main.command == ("palaestra-train",)
    assert pod.grace_s == 60


def test_probes_are_those_of_the_plan():
    """A local run must find a dead program as a cluster does.

    The ROS master has a startup probe, a sidecar a liveness probe, and the trainer both.
    """
    pod = read_pod(template(), "pod-1")

    assert pod.init[0].startup.command[0] == "bash"
    assert pod.init[1].liveness.url == "http://127.0.0.1:7200/healthz"
    assert pod.main.startup.url == pod.main.liveness.url
    assert pod.main.liveness.url == "http://127.0.0.1:9090/healthz"


def test_the_uid_of_the_pod_is_filled_in_for_each_attempt():
    """In a cluster the downward API sets this variable. attempts.jsonl distinguishes pods by their uid."""
    assert read_pod(template(), "pod-7").main.env["PALAESTRA_POD_UID"] == "pod-7"


def test_what_an_author_writes_reaches_the_program_as_it_stands():
    """A kubelet expands `$(NAME)` in such texts, so the plan escapes them.

    `read_pod` must remove the escapes.
    """
    texts = ("echo $$ $HOME", "$(ROS_HOME)", "$$(ROS_HOME)", "$")
    written = {"command": list(texts), "env": [{"name": "TEXT", "value": texts[1]}]}

    main = read_pod(template(trainer=written), "pod-1").main

    assert main.command == texts
    assert main.env["TEXT"] == texts[1]


def test_a_value_that_lies_in_a_cluster_is_refused_by_name():
    """This machine has no Secrets, so the trainer would later fail because of the missing variable."""
    secret = {"name": "TOKEN", "secretKeyRef": {"name": "hub", "key": "token"}}

    with pytest.raises(RunRefused, match=r"env TOKEN of container trainer: .* give it as `value`"):
        read_pod(template(trainer={"env": [secret]}), "pod-1")


def test_a_second_main_container_is_refused():
    """The exit code of a pod is that of its main container, so it can have only one main container."""
    two = {"spec": {"containers": [{"name": "a", "command": ["x"]}, {"name": "b", "command": ["y"]}]}}

    with pytest.raises(RunRefused, match="container b"):
        read_pod(two, "pod-1")


@pytest.mark.parametrize(
    ("drawn", "seen"),
    [
        ("plain", "plain"),
        ("windows\r", "windows"),
        ("10%\r20%\r30%", "30%"),
        ("\r\x1b[2Kinfo \x1b[32mdone\x1b[0m", "info done"),
        ("\x1b[?25h\x1b[1Atext", "text"),
    ],
)
def test_a_log_has_what_was_seen_last(drawn, seen):
    """A progress bar that is redrawn a thousand times must be one line in the log."""
    assert as_seen(drawn) == seen


@given(st.text(alphabet=st.characters(exclude_characters="\x1b\r\n")))
def test_text_without_control_sequences_is_kept(line):
    """A log must not lose a part of a traceback."""
    assert as_seen(line) == line
