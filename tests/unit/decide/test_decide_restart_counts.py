"""The counts of attempts and restarts are exact even if the operator missed changes, and never decrease."""


def test_a_failure_is_a_restart_once_another_pod_is_there(training, last_word):
    """No pod follows the last failure, so a failure alone is not a restart."""
    scene, pod = training()
    scene.end(pod, 70, last_word())
    scene.count_failures(1)
    scene.settle(5)
    before = scene.restarts()

    scene.pass_(5)
    scene.running_pod()
    scene.settle(5)

    assert (before, scene.restarts()) == ((1, 0, 0, 0), (2, 1, 0, 0))


def test_a_pod_that_was_taken_is_a_disruption(training):
    """The Job counts no failure for an evicted pod, so `backoffLimit` does not limit evictions."""
    scene, pod = training()
    scene.take(pod)
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 1, 0)


def test_a_pod_that_somebody_deleted_is_a_disruption_too(training):
    """The deleted pod left no record. Only the newer pod shows that an attempt has ended."""
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 1, 0)


def test_a_failed_pod_that_somebody_tidied_away_is_still_a_failure(training):
    """Somebody deleted the failed pod, but its Job has counted the failure."""
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.count_failures(1)
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 1, 0, 0)


def test_a_job_that_is_seen_late_is_not_needed(training, last_word):
    """Pods and Jobs come from two watches, but the failed pod alone already shows the failure."""
    scene, pod = training()
    scene.end(pod, 70, last_word())
    scene.pass_(15)
    scene.running_pod()
    scene.settle()
    assert scene.restarts() == (2, 1, 0, 0)

    scene.count_failures(1)
    scene.settle()

    assert scene.restarts() == (2, 1, 0, 0)


def test_a_pod_that_is_seen_late_is_not_needed_either(training):
    """The operator keeps the Job's count until it sees the next pod."""
    scene, pod = training()
    scene.count_failures(1)
    scene.settle()
    assert scene.restarts() == (1, 0, 0, 0)

    scene.end(pod, 70)
    scene.settle()
    scene.pass_(15)
    scene.running_pod()
    scene.settle()

    assert scene.restarts() == (2, 1, 0, 0)


def test_what_happened_while_nobody_looked_is_counted(training, last_word):
    """Failed pods stay in the cluster, and the run directory has a record of all attempts."""
    scene, pod = training()
    scene.end(pod, 70, last_word())
    scene.count_failures(1)
    scene.pass_(30)
    scene.take(scene.running_pod())
    scene.pass_(30)
    newest = scene.running_pod()
    scene.poll(newest, attempt=5)

    scene.settle()

    assert scene.restarts() == (5, 1, 3, 0)


def test_a_record_that_cannot_be_true_is_not_believed(training):
    """A pod may report any attempt number, which must not become the count."""
    scene, pod = training()
    scene.poll(pod, attempt=2**53)

    scene.settle()

    assert scene.replica().attempt == 1


def test_restarts_of_simulators_add_up_over_attempts(training, last_word, simulator):
    """A trainer counts only its own attempt, so the operator adds the counts of all attempts.

    A termination message may contain restarts since the last poll.
    """
    scene, pod = training()
    scene.poll(pod, simulators=(simulator(restarts=2), simulator(name="evaluate-0", restarts=1)))
    scene.settle()
    assert scene.replica().restarts.simulator == 3

    scene.polled.clear()
    scene.end(pod, 75, last_word(restarts=4))
    scene.settle(5)
    assert scene.replica().restarts.simulator == 4

    newest = scene.running_pod()
    scene.settle(5)
    scene.poll(newest, attempt=2, simulators=(simulator(restarts=1),))
    scene.settle()

    assert scene.replica().restarts.simulator == 5
    assert scene.replica().simulator_restarts == 1


def test_the_last_words_of_pods_that_nobody_saw_run_are_added(training, last_word, simulator):
    """The operator never polled these pods, but their termination messages have the counts."""
    scene, pod = training()
    scene.poll(pod, simulators=(simulator(restarts=1),))
    scene.settle()
    scene.end(pod, 70, last_word(restarts=2))
    scene.pass_(15)
    scene.end(scene.running_pod(), 70, last_word(restarts=3))
    scene.pass_(15)
    scene.running_pod()

    scene.settle()

    assert scene.replica().restarts.simulator == 5


def test_a_new_attempt_does_not_show_step_0(training, last_word):
    """A new trainer reports step 0 until it has read the run directory.

    Until then the status must keep the known step.
    """
    scene, pod = training()
    scene.end(pod, 75, last_word(step=50, attempt=1))
    scene.settle(5)
    newest = scene.running_pod()
    scene.poll(newest, step=0, phase="starting", attempt=None)
    scene.settle(5)
    assert scene.replica().step == 50

    scene.poll(newest, step=40, phase="starting", attempt=2)
    scene.settle()

    assert (scene.replica().step, scene.replica().furthest_step) == (40, 50)
