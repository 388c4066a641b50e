"""A pod is read with its containers in order and with shortened messages; its content is not trusted."""

import pytest

from palaestra.observe import ContainerKind
from palaestra_protocol.pod.status import Termination


def state(name, **status):
    """Return a container's status as a kubelet writes it."""
    return {"name": name, **status}


def pod(look, raw):
    """Return the observation of a raw pod."""
    return look(pods=[raw]).replicas[0].pod


def test_containers_come_in_the_order_in_which_they_start(look, raw_pod):
    """A container that waits delays all later ones, so the order counts.

    The pod's spec gives the kind of each container, and the status gives its state.
    """
    seen = pod(look, raw_pod)

    assert [(each.name, each.kind) for each in seen.containers] == [
        ("ros-master", ContainerKind.SIDECAR),
        ("sim-collect-0", ContainerKind.SIDECAR),
        ("sim-evaluate-0", ContainerKind.SIDECAR),
        ("trainer", ContainerKind.MAIN),
    ]


def test_a_sidecar_without_its_restart_policy_is_a_plain_init_container(look, raw_pod):
    """A webhook may have dropped the restart policy."""
    del raw_pod["spec"]["initContainers"][0]["restartPolicy"]

    assert pod(look, raw_pod).containers[0].kind is ContainerKind.INIT


@pytest.mark.parametrize("created", ["noon", "9999-12-31T23:59:59-23:59", None, 3])
def test_a_pod_without_a_readable_time_is_the_oldest(look, raw_pod, created):
    """Such a pod still exists, so the operator must not ignore it."""
    raw_pod["metadata"]["creationTimestamp"] = created

    assert pod(look, raw_pod).created.year == 1970


def test_a_container_that_runs_again_still_tells_how_it_ended_before(look, raw_pod):
    """The last end shows a crash loop even while the container runs."""
    running = {"running": {"startedAt": "2026-01-31T12:00:05Z"}}
    ended = {"terminated": {"exitCode": 137, "reason": "OOMKilled"}}
    raw_pod["status"]["initContainerStatuses"] = [
        state("sim-collect-0", state=running, lastState=ended, restartCount=2, started=True)
    ]

    seen = pod(look, raw_pod).containers[1]

    assert (seen.exit.code, seen.exit.reason, seen.restarts, seen.started) == (137, "OOMKilled", 2, True)
    assert seen.running_since.second == 5


def test_the_words_of_others_are_one_line_and_cut(look, raw_pod):
    """Such messages are printed on terminals and stored in a status of limited size."""
    waiting = {"waiting": {"reason": "ErrImagePull", "message": "a\n\x1b[31mred" + "x" * 5000}}
    raw_pod["status"]["containerStatuses"] = [state("trainer", state=waiting)]

    words = pod(look, raw_pod).trainer.waiting_message

    assert words.startswith("a [31mred")
    assert len(words) == 600
    assert words.isprintable()


@pytest.mark.parametrize(
    ("condition", "field", "value"),
    [
        (
            {"type": "PodScheduled", "status": "False", "reason": "Unschedulable", "message": "no room"},
            "unschedulable",
            "no room",
        ),
        ({"type": "PodScheduled", "status": "False", "reason": "SchedulingGated"}, "unschedulable", ""),
        ({"type": "DisruptionTarget", "status": "True", "message": "drained"}, "disruption", "drained"),
        ({"type": "DisruptionTarget", "status": "True"}, "disruption", "it was disrupted"),
        ({"type": "DisruptionTarget", "status": "False", "message": "no"}, "disruption", ""),
        ({"type": "Ready", "status": "True"}, "ready", True),
    ],
)
def test_conditions_say_why(look, raw_pod, condition, field, value):
    """A user must learn why a pod waits or is removed.

    The scheduler, the kubelet and the program that removes a pod each set a condition with the reason.
    """
    raw_pod["status"]["conditions"] = [condition]

    assert getattr(pod(look, raw_pod), field) == value


def test_the_last_word_is_of_our_protocol(look, raw_pod):
    """Only JSON of this format is the trainer's report, whose numbers go into the status."""
    word = Termination(step=7, reason="Completed", success_rate=0.5, attempt=2, restarts=1)
    ended = {"terminated": {"exitCode": 0, "message": word.to_message()}}
    raw_pod["status"]["containerStatuses"] = [state("trainer", state=ended)]

    assert look(pods=[raw_pod]).replicas[0].termination == word


@pytest.mark.parametrize(
    "message", ["Traceback: it", "{}", '{"step": -1, "reason": ""}', "[" * 5000, None, 3, ""]
)
def test_anything_else_is_no_last_word(look, raw_pod, message):
    """A termination message may also be the end of a log, or any text of a user's program."""
    ended = {"terminated": {"exitCode": 1, "message": message}}
    raw_pod["status"]["containerStatuses"] = [state("trainer", state=ended)]

    assert look(pods=[raw_pod]).replicas[0].termination is None


def test_a_termination_message_is_cut_where_kubernetes_cuts_it(look, raw_pod):
    """The cache must not grow with the output of a pod."""
    raw_pod["status"]["containerStatuses"] = [
        state("trainer", state={"terminated": {"exitCode": 1, "message": "x" * 100_000}})
    ]

    assert len(pod(look, raw_pod).trainer.exit.message) == 4096


def test_the_memory_limit_is_that_of_the_pods_spec(look, raw_pod):
    """The message about a memory kill names the limit of the container."""
    limits = {each.name: each.memory_limit for each in pod(look, raw_pod).containers}
    raw_pod["spec"]["containers"][0]["resources"] = {"limits": "garbage"}

    assert limits["trainer"].endswith("Gi")
    assert limits["sim-collect-0"]
    assert pod(look, raw_pod).trainer.memory_limit == ""
