"""Commands with responses that a real API server rarely sends; a scripted server sends them here."""

import pytest
import yaml

from palaestra import Client
from palaestra.cli import main
from palaestra.client import NotInstalled
from palaestra.cluster import connect
from palaestra.doctor import Site
from palaestra.doctor.installation import leads
from tests.integration.apiserver.server import raw, refusal, reply, stream

JOB = "apiVersion: palaestra.dev/v1alpha1\nkind: TrainingJob\nmetadata: {name: trial}\nspec: {}\n"
NAMED = {"name": "trial-x7k2p", "namespace": "robots", "uid": "0d1f"}
WAITS = {
    "index": 0,
    "phase": "Pending",
    "reason": "ImagePull",
    "message": "container trainer: image a:1 cannot be pulled",
    "since": "2026-01-31T12:00:05Z",
}
WHY = "ImagePull since 2026-01-31T12:00:05Z: container trainer: image a:1 cannot be pulled"
NO_RIGHT = 'trainingjobs.palaestra.dev is forbidden: User "me" cannot list resource "trainingjobs" in ...'
NO_ROOM = "trainingjobs.palaestra.dev is forbidden: exceeded quota: few, requested: 1, used: 1, limited: 1"


@pytest.fixture
def tried(server, tmp_path):
    """Return a function that runs `palaestra try` with a job and returns the exit code.

    The caller chooses the phase of the job (none if it does not exist) and the response to its deletion.
    """
    script, kubeconfig = server
    file = tmp_path / "job.yaml"
    file.write_text(JOB)

    def carry_out(phase, deletion):
        why = {"reason": "Because", "message": "so", "lastTransitionTime": "2026-01-31T12:00:00Z"}
        condition = {"type": phase or "Failed", "status": "True", **why}
        seen = reply(obj={"status": {"phase": phase, "conditions": [condition]}})
        script.calls = [
            reply(201, {"metadata": NAMED}),
            seen if phase else refusal(404, "NotFound"),
            deletion,
        ]
        return main(["try", str(file), f"--kubeconfig={kubeconfig}"])

    return carry_out


@pytest.mark.parametrize(("phase", "code"), [("Succeeded", 0), ("Failed", 1), ("", 1)])
def test_a_trial_whose_job_is_gone_already_goes_by_what_was_seen(tried, server, phase, code):
    """The job's TTL may have passed, or a user may have deleted the job.

    The command must then use the last phase that it saw. The job is in the namespace of the context.
    """
    assert tried(phase, refusal(404, "NotFound")) == code

    made, *_, deleted = server[0].of(watches=False)
    assert made.path.startswith("/apis/palaestra.dev/v1alpha1/namespaces/robots/")
    assert (deleted.method, deleted.body["preconditions"]) == ("DELETE", {"uid": "0d1f"})


@pytest.fixture
def waited(server):
    """Return a function that waits for a job, which first waits for its image and then succeeds.

    The keyword `report` is passed to the client.
    """
    script, kubeconfig = server
    job = yaml.safe_load(JOB) | {"metadata": NAMED | {"generation": 1, "resourceVersion": "1"}}
    waits = {"phase": "Pending", "observedGeneration": 1, "replicas": [WAITS]}
    ended = {"phase": "Succeeded", "observedGeneration": 1}
    last = job | {"metadata": job["metadata"] | {"resourceVersion": "2"}, "status": ended}
    script.calls = [reply(obj={"metadata": {"resourceVersion": "1"}, "items": [job | {"status": waits}]})]
    script.watches = [stream({"type": "MODIFIED", "object": last})]

    def wait(**report):
        with Client(kubeconfig=kubeconfig) as client:
            return client.wait("trial-x7k2p", deadline_s=20.0, **report)

    return wait


def test_a_wait_reports_phases_and_why_replicas_wait(waited):
    """During the wait, the user reads the phases and the waiting reasons in the notebook."""
    lines = []

    assert waited(report=lines.append).status.phase == "Succeeded"
    assert lines == ["trial-x7k2p: Pending", f"trial-x7k2p: replica 0: {WHY}", "trial-x7k2p: Succeeded"]


def test_a_wait_prints_nothing_of_its_own(waited, capsys):
    """A library must not print unless its caller requests it."""
    waited()

    assert capsys.readouterr() == ("", "")


def test_a_trial_prints_why_its_replica_waits(server, tmp_path, monkeypatch, capsys):
    """Without a line about the replica, `helm test` with a wrong image printed nothing until its timeout."""
    monkeypatch.setattr("palaestra.smoke_test.PERIOD_S", 0.0)
    script, kubeconfig = server
    (tmp_path / "job.yaml").write_text(JOB)
    waits = reply(obj={"status": {"phase": "Pending", "replicas": [WAITS]}})
    succeeded = reply(obj={"status": {"phase": "Succeeded"}})
    script.calls = [reply(201, {"metadata": NAMED}), waits, waits, succeeded, reply()]

    assert main(["try", str(tmp_path / "job.yaml"), f"--kubeconfig={kubeconfig}"]) == 0

    assert capsys.readouterr().out.splitlines() == [
        "robots/trial-x7k2p: Pending",
        f"robots/trial-x7k2p: replica 0: {WHY}",
        "robots/trial-x7k2p: Succeeded",
    ]


@pytest.mark.parametrize(("phase", "code"), [("Succeeded", 0), ("Failed", 1)])
def test_a_trial_that_cannot_be_deleted_for_now_is_reported_beside_its_verdict(tried, capsys, phase, code):
    """A short outage of the API server is no error of the tested installation."""
    assert tried(phase, refusal(503, "ServiceUnavailable")) == code

    assert "delete it by hand: `kubectl delete trainingjob -n robots trial-x7k2p`" in capsys.readouterr().out


def test_a_trial_that_may_not_be_deleted_fails(tried, capsys):
    """A missing permission would leave a job behind after every trial."""
    assert tried("Succeeded", refusal(403, "Forbidden")) == 1

    assert capsys.readouterr().err == "Forbidden (403): no\n"


def test_a_trial_that_failed_tells_why_although_it_may_not_be_deleted(tried, capsys):
    """The user must first see and fix the failure of the job, not the missing permission."""
    assert tried("Failed", refusal(403, "Forbidden")) == 1

    said = capsys.readouterr()
    assert "Failed; Because: so" in said.err
    assert "delete it by hand" in said.out


@pytest.mark.parametrize(("message", "hint"), [(NO_RIGHT, True), (NO_ROOM, False)])
def test_the_doctor_is_named_where_a_right_is_missing_alone(server, capsys, message, hint):
    """The doctor lists missing permissions, but knows nothing about quotas and policies."""
    script, kubeconfig = server
    answer = {"kind": "Status", "code": 403, "reason": "Forbidden", "message": message}
    script.calls = [reply(403, answer)]

    assert main(["get", "-o", "name", f"--kubeconfig={kubeconfig}"]) == 1

    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith(f"Forbidden (403): {message}")
    assert line.endswith("; `palaestra doctor` lists the missing rights") is hint


@pytest.mark.parametrize(
    ("answer", "code", "said"),
    [
        (reply(obj={"columnDefinitions": [], "rows": []}), 0, ""),
        (refusal(404, "NotFound"), 1, "job trial: does not exist in namespace robots"),
    ],
    ids=["there", "not there"],
)
def test_one_job_is_asked_for_once(server, capsys, answer, code, said):
    """The command prints the API server's table, so it needs no second request for the object."""
    script, kubeconfig = server
    script.calls = [answer]

    assert main(["get", "trial", f"--kubeconfig={kubeconfig}"]) == code

    assert len(script.of(watches=False)) == 1
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    "command",
    [
        *("get", "get trial", "get -o name", "describe trial", "watch trial", "logs trial", "events trial"),
        *("suspend trial", "resume trial", "delete trial", "fetch trial", "try FILE"),
    ],
)
def test_the_error_for_a_cluster_without_trainingjobs_shows_how_to_install_them(
    server, tmp_path, capsys, command
):
    """The API server responds with `404 page not found`, which looks as if the job's name were wrong."""
    script, kubeconfig = server
    file = tmp_path / "job.yaml"
    file.write_text(JOB)
    script.calls = [raw(b"404 page not found\n", 404)]

    code = main([*command.replace("FILE", str(file)).split(), f"--kubeconfig={kubeconfig}"])

    [line] = capsys.readouterr().err.splitlines()
    assert code == 1
    assert "the cluster has no TrainingJob definition; install it with `palaestra crd | kubectl apply" in line


def test_logs_of_a_container_that_is_not_there_lists_those_that_are(server, capsys):
    """The API server names only the wrong container, and `describe` does not list the containers."""
    script, kubeconfig = server
    pod = {"name": "trial-0-x7k2p", "uid": "u", "created": "2026-01-31T12:00:00Z"}
    status = {"replicas": [{"index": 0, "phase": "Running", "pod": pod}]}
    refused = {"reason": "BadRequest", "message": "container nope is not valid for pod trial-0-x7k2p"}
    script.calls = [
        reply(obj=yaml.safe_load(JOB) | {"metadata": {**NAMED, "name": "trial"}, "status": status}),
        reply(400, refused),
    ]

    assert main(["logs", "trial", "-c", "nope", f"--kubeconfig={kubeconfig}"]) == 1

    there = "trainer, ros-master, sim-collect-0, sim-evaluate-0"
    said = capsys.readouterr().err
    assert said == f"pod trial-0-x7k2p: has no container nope; its containers are {there}\n"


@pytest.mark.parametrize(
    ("path", "container"),
    [
        ({"fieldPath": "spec.containers{trainer}"}, "trainer"),
        ({"fieldPath": "spec.initContainers{sim-collect-0}"}, "sim-collect-0"),
        ({"fieldPath": "spec.hostname"}, ""),
        ({}, ""),
    ],
)
def test_an_event_knows_the_container_that_it_is_about(server, path, container):
    """The kubelet's message `Container created` lacks the container's name, which a user needs."""
    script, kubeconfig = server
    event = {
        "metadata": {"name": "a", "creationTimestamp": "2026-01-31T12:00:00Z"},
        "involvedObject": {"kind": "Pod", "name": "trial-0-x7k2p", **path},
        "reason": "Created",
        "message": "Container created",
    }
    job = yaml.safe_load(JOB) | {"metadata": {**NAMED, "name": "trial"}}
    script.calls = [reply(obj=job), reply(obj={"metadata": {}, "items": [event]})]

    with Client(kubeconfig=kubeconfig) as client:
        [found] = client.events("trial")

    assert (found.about, found.container) == ("Pod/trial-0-x7k2p", container)


def test_programs_can_catch_that_a_cluster_does_not_know_trainingjobs(server):
    """`apply`, `list` and `wait` must raise the same error, so a program need not parse a message."""
    script, kubeconfig = server
    script.calls = [raw(b"404 page not found\n", 404)]

    with Client(kubeconfig=kubeconfig) as client:
        for call in (
            lambda: client.apply(yaml.safe_load(JOB)),
            client.list,
            lambda: client.wait("trial", deadline_s=1.0),
        ):
            with pytest.raises(NotInstalled):
                call()


def test_a_job_that_is_made_anew_under_the_name_is_not_waited_for(server):
    """`delete` must return even if a GitOps controller creates a job of the same name at once."""
    script, kubeconfig = server
    anew = {"metadata": NAMED | {"uid": "another", "resourceVersion": "2"}}
    script.calls = [
        reply(obj={"metadata": NAMED}),
        reply(),
        reply(obj={"metadata": {"resourceVersion": "2"}, "items": [anew]}),
    ]

    with Client(kubeconfig=kubeconfig) as client:
        client.delete("trial", deadline_s=20.0)

    assert len(script.of(watches=True)) == 0


def test_a_lease_that_is_given_back_has_no_leader(server):
    """An operator leads only after the lease has a new holder, so the doctor must wait for that change."""
    script, kubeconfig = server

    def lease(version, holder):
        metadata = {"name": "palaestra-operator", "uid": "u", "resourceVersion": version}
        return {"metadata": metadata, "spec": {"holderIdentity": holder}}

    script.calls = [
        refusal(404, "NotFound"),
        reply(obj={"metadata": {"resourceVersion": "1"}, "items": [lease("1", "first")]}),
    ]
    script.watches = [
        stream(
            {"type": "MODIFIED", "object": lease("2", "")},
            {"type": "MODIFIED", "object": lease("3", "second")},
            ends="silent",
        )
    ]
    api = connect(kubeconfig)

    [found] = leads(Site(api=api, namespace="robots", operator_namespace="palaestra-system"))

    api.close()
    assert found.fact == "is second"
