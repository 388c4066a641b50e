"""A complete training in a namespace that refuses everything that *restricted* forbids."""

from datetime import datetime, timedelta

import pytest

from tests.e2e.askers import plain_pod
from tests.e2e.cluster import CommandFailed, Refused
from tests.e2e.jobs import WAIT
from tests.e2e.namespace import LONG_S, statuses

ENDS = {
    "when all is up": "until (: </dev/tcp/127.0.0.1/7200) 2>/dev/null; do sleep 0.2; done",
    "at once": "exit 0",
}
TOKEN = "/var/run/secrets/kubernetes.io/serviceaccount/token"


def test_a_pod_that_asks_for_more_is_refused_here(namespace):
    """If the namespace did not enforce *restricted*, the tests below would prove nothing."""
    pod = plain_pod("control")
    del pod["spec"]["securityContext"]["runAsNonRoot"]

    with pytest.raises(Refused) as refusal:
        namespace.create("pods", pod)

    assert refusal.value.code == 403
    assert 'violates PodSecurity "restricted' in refusal.value.message


@pytest.mark.beside
@pytest.mark.after_the_kills
@pytest.mark.timeout(1200)
def test_a_training_succeeds_and_its_status_tells_how(namespace, job):
    """A person learns everything about an ended run from its status, without access to the pod."""
    namespace.apply(job("tiny"))

    assert namespace.wait_for_end("tiny") == "Succeeded"
    namespace.wait(lambda: namespace.events("tiny", "Succeeded"))  # the event follows the status

    status = namespace.status("tiny")
    replica = status["replicas"][0]
    assert status["observedGeneration"] == 1
    assert status["startTime"] < status["completionTime"]
    assert namespace.holds("tiny", "Accepted")
    assert namespace.holds("tiny", "Succeeded")
    assert replica["step"] == replica["target"] == replica["lastCheckpoint"]["step"] == 2000
    assert 0 <= replica["successRate"] <= 1
    assert replica["attempt"] == 1
    assert all(namespace.events("tiny", reason) for reason in ("Accepted", "Planned", "Succeeded"))
    assert namespace.pods_made("tiny") == 1


@pytest.mark.beside
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("moment", ENDS)
def test_a_pod_ends_with_its_trainer(namespace, job, moment):
    """Simulators and the ROS master must end with the trainer, because a preempted node allows little time.

    This holds even while the sidecars start, when process 1 of a container has no handler for signals yet.
    """
    namespace.apply(job("ends", script=ENDS[moment]))
    assert namespace.wait_for_end("ends") == "Succeeded"

    (pod,) = namespace.pods("ends", live=False)
    ended = {each["name"]: finished(each["state"]["terminated"]) for each in statuses(pod)}
    assert max(ended.values()) - ended["trainer"] < timedelta(seconds=10)


def finished(terminated):
    """Return the time at which a container ended."""
    return datetime.fromisoformat(terminated["finishedAt"])


@pytest.mark.beside
@pytest.mark.timeout(1200)
def test_no_container_can_write_its_image_or_speak_to_the_cluster(namespace, job):
    """A user's code in the trainer must change no image and get no token for the API server."""
    namespace.apply(job("waits", script=WAIT))
    pod = namespace.wait_for_pod("waits", LONG_S)

    for container in ("trainer", "sim-collect-0", "ros-master"):
        assert namespace.execute(pod, "id", "-u", container=container).strip() == "65532"
        with pytest.raises(CommandFailed, match=r"[Rr]ead-only"):
            namespace.execute(pod, "touch", "/etc/palaestra-was-here", container=container)
        with pytest.raises(CommandFailed, match="No such file"):
            namespace.execute(pod, "cat", TOKEN, container=container)
