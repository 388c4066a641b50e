"""`palaestra try` tests an installation with a job that it deletes afterwards."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from palaestra.cli import main
from palaestra.cluster.resources import CLAIMS, TRAINING_JOBS
from palaestra.smoke_test import TTL_S
from tests.integration.operator.test_operator_lifecycle import DONE
from tests.waiting import DEADLINE_S, eventually

WITHIN_S = 60
JOB = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata: {{name: trial, namespace: {namespace}}}
spec: {{backoffLimit: 0}}
"""


@pytest.fixture
def trial(place, control_plane, tmp_path):
    """Return a function that runs the command and returns its exit code.

    The function runs its argument in another thread, because the command handles signals in this thread.
    """
    file = tmp_path / "job.yaml"
    file.write_text(JOB.format(namespace=place.name))

    def carry_out(meanwhile):
        with ThreadPoolExecutor(1) as threads:
            done = threads.submit(meanwhile)
            code = main(
                ["try", str(file), f"--kubeconfig={control_plane.kubeconfig}", f"--within={WITHIN_S}"]
            )
            done.result(DEADLINE_S)
        return code

    return carry_out


@pytest.fixture
def pod(place, start):
    """Return a function that waits until the pod of the trial runs, and returns the pod."""
    start()

    def running():
        [job] = eventually(lambda: place.all(TRAINING_JOBS))
        name = job["metadata"]["name"]
        [found] = place.pods(name)
        place.run(found)
        place.until("Running", name)
        return found

    return running


def test_a_trial_that_succeeds_says_so_and_leaves_nothing(place, trial, pod, capsys):
    """`helm test` reports success by exit code 0, and the namespace must be as before."""
    assert trial(lambda: place.end(pod(), word=DONE)) == 0
    phases = [line.rpartition(": ")[2] for line in capsys.readouterr().out.splitlines()]
    assert phases[-1] == "Succeeded"
    assert place.all(TRAINING_JOBS) == []


def test_a_trial_takes_its_claims_away_with_its_job(place, trial, pod):
    """A pipeline that tests each release would otherwise fill its namespace's storage quota."""

    def see_claim():
        found = pod()
        assert len(place.all(CLAIMS)) == 1
        place.end(found, word=DONE)

    assert trial(see_claim) == 0
    eventually(lambda: not place.all(CLAIMS))


def test_a_trial_that_fails_says_why_and_leaves_nothing(place, trial, pod, capsys):
    """The job is deleted, so the reason must be in the output of the command."""
    assert trial(lambda: place.end(pod(), 2)) == 1
    assert "Failed; ConfigurationRefused: " in capsys.readouterr().err
    assert place.all(TRAINING_JOBS) == []


def test_the_job_of_a_trial_that_is_killed_ends_and_goes_by_itself(place, trial, pod):
    """After SIGKILL, the command cannot delete its job, so the job has a deadline and a TTL.

    Fields that the author has set keep their values.
    """
    seen = []

    def look():
        found = pod()
        seen.extend(place.all(TRAINING_JOBS))
        place.end(found, word=DONE)

    trial(look)
    [spec] = [job["spec"] for job in seen]
    assert WITHIN_S <= spec["activeDeadlineSeconds"] <= 2 * WITHIN_S
    assert spec["ttlSecondsAfterFinished"] == TTL_S
    assert spec["backoffLimit"] == 0
