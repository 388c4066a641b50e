"""A sweep with responses that a real API server rarely sends; a scripted server sends them here."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import yaml

from palaestra import Client
from palaestra.api import validate
from palaestra.cluster.errors import Unreachable
from palaestra.job_input import data_of
from palaestra.sweeps.cluster_backend import QUIET_LOOKS, ClusterBackend
from palaestra.sweeps.model import LABEL
from palaestra.sweeps.trial import Trial, TrialProgress
from tests.integration.apiserver.server import hang_up, refusal, reply
from tests.waiting import eventually

JOB = "apiVersion: palaestra.dev/v1alpha1\nkind: TrainingJob\nmetadata: {name: trial}\nspec: {}\n"
NAMED = {"name": "trial-x7k2p", "namespace": "robots", "uid": "0d1f"}
PATIENCE_S = 30.0


@pytest.fixture
def trial():
    """Return the first trial of the sweep `s`."""
    job = {**yaml.safe_load(JOB), "metadata": {"name": "s-0", "labels": {LABEL: "s"}}}
    return Trial(number=0, changes={}, job=validate(job))


def test_a_trial_whose_job_was_deleted_makes_room_for_the_next(server, trial):
    """With one trial at a time, the sweep would wait forever for a deleted job."""
    script, kubeconfig = server
    stored = {**data_of(trial.job), "metadata": {"name": "s-0", "labels": {LABEL: "s"}}}
    script.calls = [refusal(404, "NotFound"), reply(201, stored), reply(obj={"metadata": {}, "items": []})]

    with Client(kubeconfig=kubeconfig) as client:
        place = ClusterBackend(client, "s", 1, print, look_s=0.01)
        place.begin(trial)
        full = not place.has_room()
        place.wait()
        figures = place.look(trial)

    assert full
    assert figures.state is TrialProgress.FAILED
    assert place.has_room()


def test_a_sweep_reports_an_api_server_that_is_away_once_and_its_return(server):
    """Without a report, the command would seem to hang, but a short outage is not worth a line."""
    script, kubeconfig = server
    none = reply(obj={"metadata": {}, "items": []})
    away = [refusal(503, "ServiceUnavailable")] * (QUIET_LOOKS - 1)
    script.calls = [none, *away, none, *away, hang_up]
    said = []

    with Client(kubeconfig=kubeconfig) as client, ThreadPoolExecutor(1) as pool:
        place = ClusterBackend(client, "s", 1, said.append, look_s=0.01)
        place.wait()
        place.wait()
        quiet = list(said)
        waited = pool.submit(place.wait)
        eventually(lambda: len(script.asked) > 4 * QUIET_LOOKS, PATIENCE_S)
        script.calls = [none]
        waited.result(PATIENCE_S)
        place.wait()

    assert quiet == []
    assert len(said) == 2
    assert said[0].startswith("the API server has not responded for a while (")
    assert said[0].endswith("); the trials continue, and this command retries")
    assert said[1] == "the API server responds again"


def test_a_sweep_begins_and_prunes_trials_although_the_api_server_is_away_meanwhile(server, trial):
    """The upgrade of a control plane takes minutes, and must not end a search that takes days."""
    script, kubeconfig = server
    stored = {**data_of(trial.job), "metadata": {"name": "s-0", "uid": "u", "labels": {LABEL: "s"}}}
    away, gone = refusal(503, "ServiceUnavailable"), refusal(404, "NotFound")
    script.calls = [
        *[reply(obj={"metadata": {}, "items": []}), away, gone, away, reply(obj=stored), reply(obj=stored)],
        *[away, reply(obj=stored), away, gone],
    ]

    with Client(kubeconfig=kubeconfig) as client:
        place = ClusterBackend(client, "s", 1, print, look_s=0.01)
        place.wait()
        place.begin(trial)
        place.prune(trial)

    methods = " ".join(asked.method for asked in script.asked)
    assert methods == "GET GET GET PATCH GET PATCH GET GET DELETE GET"
    assert place.has_room()


def test_a_sweep_refuses_an_api_server_that_does_not_answer_at_first(server, trial):
    """At the start, the kubeconfig may name a wrong cluster, so the command must fail at once."""
    script, kubeconfig = server
    script.calls = [hang_up]

    with Client(kubeconfig=kubeconfig) as client, pytest.raises(Unreachable):
        ClusterBackend(client, "s", 1, print, look_s=0.01).begin(trial)


@pytest.mark.parametrize("answers", [[], [reply(obj={"metadata": NAMED})]], ids=["before", "meanwhile"])
def test_a_trial_whose_job_somebody_deletes_can_be_pruned(server, trial, answers):
    """If a user has deleted the job already, the sweep must not fail when it deletes that job."""
    script, kubeconfig = server
    script.calls = [*answers, refusal(404, "NotFound")]

    with Client(kubeconfig=kubeconfig) as client:
        ClusterBackend(client, "s", 1, print).prune(trial)

    assert [asked.method for asked in script.asked] == ["GET", "DELETE"][: 1 + len(answers)]
