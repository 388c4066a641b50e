"""The clocks of different machines differ, so no deadline depends on the difference of two machines' times.

`scene.behind_s` is the delay of a node's clock behind the API server's; `scene.set_clock` moves the
operator's clock.
"""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Replace, Stop

HOUR_S = 3600


def stops(decision):
    """Return the reasons of the replicas that a decision stops, or whose pods it replaces."""
    return [each.reason.value for each in decision.actions if isinstance(each, Stop | Replace)]


@pytest.mark.parametrize("tells_ages", [True, False])
@pytest.mark.parametrize("behind_s", [721, -721, 86_400])
def test_a_node_whose_clock_is_off_does_not_end_a_trainer_that_steps(accepted, behind_s, tells_ages):
    """The times that the trainer reports differ from the operator's clock by minutes.

    The trainer also reports the age of its last step, which does not depend on the node's clock.
    """
    scene = accepted(stallDeadlineSeconds=600)
    scene.behind_s = behind_s
    pod = scene.running_pod()
    found = []
    for step in range(100):
        scene.pass_(10)
        ages = {"last_progress_age_s": 0.2} if tells_ages else {}
        scene.poll(pod, step=step, last_progress=scene.node_stamp(), **ages)
        found += stops(scene.step())

    assert found == []
    assert scene.replica().reason == "Training"


@pytest.mark.parametrize("behind_s", [115, 721])
def test_a_node_whose_clock_is_behind_does_not_end_a_trainer_that_starts(accepted, simulator, behind_s):
    """By the operator's clock the container seems to have started minutes ago."""
    scene = accepted()
    scene.behind_s = behind_s
    pod = scene.running_pod()
    scene.poll(pod, phase="starting", simulators=(simulator(state="starting"),))

    assert stops(scene.step()) == []
    assert stops(scene.step(30)) == []


def test_a_node_whose_clock_is_behind_has_its_time_to_start_the_trainer(accepted):
    """By the operator's clock all sidecars seem to have run for ten minutes."""
    scene = accepted()
    scene.behind_s = 600
    scene.container(scene.running_pod(), "trainer", waiting="PodInitializing")

    assert stops(scene.step()) == []
    assert stops(scene.step(299)) == []
    assert stops(scene.step(1)) == ["TrainerNotStarted"]


@pytest.mark.parametrize("seconds", [900, -HOUR_S, 30 * 86_400])
def test_setting_the_operators_clock_ends_nothing(training, seconds):
    """A person may correct the clock, or a virtual machine may continue after a pause."""
    scene, pod = training(stallDeadlineSeconds=600, activeDeadlineSeconds=HOUR_S)
    scene.poll(pod, step=1, last_progress_age_s=1.0)
    scene.settle(10)

    scene.set_clock(seconds)
    scene.poll(pod, step=2, last_progress_age_s=1.0)

    assert stops(scene.step(10)) == []
    assert scene.replica().reason == "Training"
    assert scene.status.active_seconds == 20


def test_setting_the_operators_clock_back_ends_what_is_over_all_the_same(training):
    """With the wall clock, the deadline would pass an hour too late."""
    scene, _ = training(activeDeadlineSeconds=60)
    scene.set_clock(-HOUR_S)

    assert stops(scene.step(60)) == ["DeadlineExceeded"]


def test_a_new_process_begins_every_wait_anew(training):
    """The new process has another monotonic clock.

    A restart of the operator may make a wait longer, but never shorter.
    """
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, step=50)
    scene.settle()
    scene.pass_(170)
    scene.restart()
    scene.poll(pod, step=50)
    scene.settle()
    scene.pass_(179)
    scene.poll(pod, step=50)

    assert stops(scene.step()) == []
    assert stops(scene.step(1)) == ["Stalled"]


def test_a_new_process_believes_a_trainer_that_tells_how_long_it_stands(training):
    """The trainer measures the age of its last step with its own monotonic clock.

    A restart of the operator does not reset this age.
    """
    scene, pod = training(stallDeadlineSeconds=60)
    scene.restart()
    scene.poll(pod, step=50, last_progress_age_s=180.0)

    assert stops(scene.step()) == ["Stalled"]


def test_active_time_is_kept_by_the_status_and_goes_on_in_a_new_process(training):
    """A restart loses the active time since the last write of the status, so the deadline comes later."""
    scene, pod = training(activeDeadlineSeconds=100)
    scene.poll(pod, step=1)
    scene.settle(60)
    assert scene.status.active_seconds == 60
    scene.restart()
    scene.set_clock(-HOUR_S)
    scene.settle()

    assert stops(scene.step(39)) == []
    assert stops(scene.step(1)) == ["DeadlineExceeded"]


@pytest.mark.parametrize("ago_s", [0, HOUR_S])
def test_a_lost_node_is_waited_for_from_the_first_sight_of_a_deletion(training, ago_s):
    """The API server's clock may be an hour behind the operator's.

    So the operator uses the length of the grace period and ignores the deletion's time.
    """
    scene, pod = training()
    scene.server_s -= ago_s
    scene.delete(pod, 60)
    scene.settle()

    scene.settle(89)
    assert scene.replica().reason == "Training"
    scene.settle(1)

    assert scene.replica().reason == "NodeLost"


def test_the_last_word_is_waited_for_whenever_its_job_says_that_it_ended(training, last_word):
    """The control plane's clock sets the time of a Job's end.

    The operator must not compare this time with its own clock.
    """
    scene, pod = training()
    scene.server_s -= HOUR_S
    scene.end_job("Complete")
    scene.step()
    assert scene.status.phase is Phase.RUNNING
    scene.end(pod, 0, last_word(step=7))

    scene.step(1)

    assert (scene.status.phase, scene.replica().step) == (Phase.SUCCEEDED, 7)


@pytest.mark.parametrize("server_s", [-HOUR_S, HOUR_S])
def test_a_completion_time_is_the_operators_own(training, last_word, server_s):
    """`ttlSecondsAfterFinished` counts from the completion time, so both must come from one clock."""
    scene, pod = training(ttlSecondsAfterFinished=60)
    scene.server_s += server_s
    scene.end(pod, 0, last_word(step=100))
    scene.end_job("Complete")

    decision = scene.step()

    assert scene.status.completion_time == scene.now
    assert decision.wake_after_s == 60


def kill(scene, pod, run):
    """Let the kernel kill the simulator in a run of its container; the kubelet restarts the container."""
    scene.container(pod, "sim-collect-0", running=True, restarts=run + 1)
    ended = {"exitCode": 137, "reason": "OOMKilled", "finishedAt": scene.node_stamp()}
    for each in pod["status"]["initContainerStatuses"]:
        if each["name"] == "sim-collect-0":
            each["lastState"] = {"terminated": ended}


def kills(scene):
    """Return the number of memory kills of each container."""
    return [each.times for each in scene.replica().memory_kills]


def test_kills_are_distinguished_by_pod_and_run_and_not_by_the_clocks_of_nodes(training):
    """The second node's clock is behind, so the time of the second kill is earlier than that of the first."""
    scene, pod = training()
    kill(scene, pod, 0)
    scene.settle(5)
    scene.take(pod)
    scene.settle(5)
    scene.behind_s = HOUR_S
    second = scene.running_pod()
    kill(scene, second, 0)
    scene.settle(5)
    assert kills(scene) == [2]
    scene.behind_s = 2 * HOUR_S
    kill(scene, second, 1)

    scene.settle(5)

    assert kills(scene) == [3]


def test_a_kill_is_counted_once_though_the_status_has_no_room_for_its_run(training):
    """A status at its size limit drops the pod and the run of a kill.

    The count must not grow at each reconcile.
    """
    scene, pod = training()
    kill(scene, pod, 0)
    for _ in range(3):
        scene.step(5)
        for each in scene.raw["status"]["replicas"][0]["memoryKills"]:
            each.pop("pod", None), each.pop("run", None)

    assert kills(scene) == [1]
