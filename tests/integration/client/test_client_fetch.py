"""`fetch` copies a whole run or nothing, and leaves no pod.

A scripted server stands in for the cluster.
"""

import io
import json
import tarfile
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from palaestra import Client
from palaestra.cli import main
from palaestra.client import NotFetched, TookTooLong
from palaestra.cluster import Unreachable
from palaestra.plan import ClusterLayout, Images, identified, plan
from tests.integration.apiserver.server import command, refusal, reply, serving, stream
from tests.unit.view.jobs import running_job

SUCCESS = b"\x03" + json.dumps({"status": "Success"}).encode()
FAILURE = (
    b"\x03"
    + json.dumps(
        {"status": "Failure", "details": {"causes": [{"reason": "ExitCode", "message": "1"}]}}
    ).encode()
)
FINISHED = Path(__file__).parents[2] / "fixtures/0.1.0/finished"
KEPT = ("attempts.jsonl", "hyperparameters.json", "summary.json", "training.yaml")
FILES = {"model.zip": b"weights" * 10_000, "tensorboard/events": b"curves"}
RUN_POD = "job-0-x7k2p"
WAITING = {"reason": "ErrImagePull", "message": "no such image"}


def tar(files):
    """Return the websocket messages that contain a tar of these files."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    whole = file.getvalue()
    return [b"\x01" + whole[i : i + 30_000] for i in range(0, len(whole), 30_000)]


class Scene:
    """A job with one replica in a scripted cluster.

    Attributes:
        phase: the phase of the run's pod, or None if the pod does not exist.
        trainer: the state of the pod's trainer container.
        replica: fields of the replica's status.
        reader: the status of the pod that `fetch` creates to read the volume.
        execution: the course of a command in a container.
        deletion: the response to the deletion of that pod.
    """

    def __init__(self, address, script, tmp_path):
        self.phase = "Succeeded"
        self.trainer = {"running": {}}
        self.replica = {"phase": "Succeeded"}
        self.reader = {"phase": "Running"}
        self.execution = command(*tar(FILES), SUCCESS)
        self.deletion = reply(200)
        self.ephemeral = False
        self.into = tmp_path / "fetched"
        self._script = script
        script.calls, script.watches = [self._answer], [stream()]
        kubeconfig = tmp_path / "kubeconfig"
        kubeconfig.write_text(
            json.dumps(
                {
                    "current-context": "a",
                    "contexts": [{"name": "a", "context": {"cluster": "c", "user": "u", "namespace": "lab"}}],
                    "clusters": [{"name": "c", "cluster": {"server": address}}],
                    "users": [{"name": "u", "user": {}}],
                }
            )
        )
        self.client = Client(kubeconfig=str(kubeconfig))

    def fetch(self, deadline_s=30.0):
        """Fetch the run of the job."""
        return self.client.fetch("job", into=str(self.into), deadline_s=deadline_s)  # users often pass a str

    def left(self):
        """Return the files in the target folder."""
        return {
            str(each.relative_to(self.into)): each.read_bytes()
            for each in self.into.rglob("*")
            if each.is_file()
        }

    def asked(self, method, end):
        """Return the requests of this method whose path ends with `end`."""
        return [
            each
            for each in self._script.of(watches=False)
            if each.method == method and each.path.endswith(end)
        ]

    def _answer(self, exchange):
        path, method = urlsplit(exchange.path).path, exchange.command
        pods = "/api/v1/namespaces/lab/pods"
        made = {"metadata": {"name": "r", "namespace": "lab", "uid": "reader", "resourceVersion": "1"}}
        answers = {
            ("GET", "/apis/palaestra.dev/v1alpha1/namespaces/lab/trainingjobs/job"): partial(
                reply, obj=self._job()
            ),
            ("GET", "/apis/batch/v1/namespaces/lab/jobs/job-0"): partial(reply, obj=self._replica()),
            ("GET", f"{pods}/{RUN_POD}"): partial(reply, obj={"status": self._pod_status()}),
            ("POST", pods): partial(reply, obj=made),
            ("GET", pods): partial(
                reply, obj={"metadata": {"resourceVersion": "1"}, "items": [made | {"status": self.reader}]}
            ),
        }
        if path.endswith("/exec"):
            self.execution(exchange)
        elif method == "DELETE":
            self.deletion(exchange)
        elif path.endswith(RUN_POD) and self.phase is None:
            refusal(404, "NotFound")(exchange)
        else:
            answers[method, path]()(exchange)

    def _pod_status(self):
        containers = [{"name": "trainer", "state": self.trainer}]
        return {"phase": self.phase, "containerStatuses": containers}

    def _job(self):
        pod = {"name": RUN_POD, "uid": "u", "created": "2026-01-31T12:00:00Z"}
        spec = {"storage": {"ephemeral": self.ephemeral}}
        job = running_job(spec=spec, pod=pod).model_dump(mode="json", by_alias=True, exclude_none=True)
        job["status"]["replicas"][0] |= self.replica
        return job

    def _replica(self):
        images = Images(trainer="trainer:1", stub="stub:1", mujoco="mujoco:1", webots="webots:1")
        return dict(plan(identified(running_job(), "0d1f"), ClusterLayout(images=images)).replicas[0].job)


@pytest.fixture
def scene(tmp_path):
    """Yield a job in a scripted cluster."""
    with serving() as (address, script):
        made = Scene(address, script, tmp_path)
        yield made
        made.client.close()


def test_a_run_that_goes_on_is_read_in_its_own_pod(scene):
    """Only one node can mount the volume, and the run's own pod is on that node."""
    scene.phase, scene.replica = "Running", {"phase": "Running"}

    folder = scene.fetch()

    assert folder == scene.into / "job" / "0"
    assert scene.left() == {f"job/0/{name}": content for name, content in FILES.items()}
    assert scene.asked("POST", "/pods") == []
    assert len(scene.asked("GET", f"/{RUN_POD}/exec")) == 1


@pytest.mark.parametrize(
    ("phase", "replica"),
    [
        ("Succeeded", "Succeeded"),
        ("Succeeded", "Running"),  # the operator has not seen the end yet
        ("Failed", "Failed"),
        ("Failed", "Suspended"),
        (None, "Succeeded"),
        (None, "Suspended"),
    ],
)
def test_a_run_that_has_ended_is_read_with_a_pod_that_is_deleted_again(scene, phase, replica):
    """The deletion names the pod's uid, so that it cannot hit another pod with the name."""
    scene.phase, scene.replica = phase, {"phase": replica}

    scene.fetch()

    [made] = scene.asked("POST", "/pods")
    name = made.body["metadata"]["name"]
    [gone] = scene.asked("DELETE", name)
    assert scene.left().keys() == {f"job/0/{each}" for each in FILES}
    assert len(scene.asked("GET", f"/{name}/exec")) == 1
    assert gone.body["preconditions"] == {"uid": "reader"}


@pytest.mark.parametrize(
    ("execution", "error"),
    [
        (command(*tar(FILES), FAILURE), NotFetched),
        (command(*tar(FILES)), Unreachable),
        (command(tar(FILES)[0], ends="broken"), Unreachable),
        (command(*tar({}), SUCCESS), NotFetched),
        (refusal(403, "Forbidden"), OSError),
    ],
    ids=["it fails", "its end is not told", "it breaks off", "nothing is there", "it is not allowed"],
)
def test_what_is_not_whole_is_not_written_and_the_pod_is_deleted(scene, execution, error):
    """A user would take half of a policy for a complete policy."""
    scene.execution = execution

    with pytest.raises(error):
        scene.fetch()

    assert scene.left() == {}
    assert list(scene.into.rglob(".fetch-*")) == []
    assert len(scene.asked("DELETE", scene.asked("POST", "/pods")[0].body["metadata"]["name"])) == 1


def test_a_copy_that_takes_too_long_says_so(scene):
    """The connection works, so the user needs more time and not another address."""
    scene.execution = command(tar(FILES)[0], ends="silent")

    with pytest.raises(TookTooLong, match="was not copied in time; allow more time with --timeout"):
        scene.fetch(deadline_s=2.0)
    assert scene.left() == {}


@pytest.mark.parametrize("code", [403, 503])
def test_a_pod_that_cannot_be_deleted_spoils_no_copy(scene, code):
    """The copy is complete and the pod ends by itself, so the command must not fail."""
    scene.deletion = refusal(code, "Refused")

    assert scene.fetch() == scene.into / "job" / "0"


def test_a_folder_that_is_there_is_left_as_it_is(scene):
    """The command must refuse before it creates a pod."""
    there = scene.into / "job" / "0"
    there.mkdir(parents=True)

    with pytest.raises(NotFetched, match="already exists; move it away"):
        scene.fetch()
    assert scene.asked("POST", "/pods") == []


def test_a_pod_that_is_about_to_start_is_not_robbed_of_its_volume(scene):
    """A second pod would bind the volume to another node, and the run's pod could not start."""
    scene.phase = "Pending"

    with pytest.raises(NotFetched, match=f"pod {RUN_POD}: is about to start"):
        scene.fetch()
    assert scene.asked("POST", "/pods") == []


def test_a_pod_whose_trainer_has_just_ended_is_not_entered(scene):
    """The pod ends when its simulators have stopped, and a copy in that pod would break off."""
    scene.phase, scene.trainer = "Running", {"terminated": {"exitCode": 0}}

    with pytest.raises(NotFetched, match=f"pod {RUN_POD}: its trainer has just ended; .* in a minute"):
        scene.fetch()
    assert scene.asked("GET", "/exec") == []
    assert scene.asked("POST", "/pods") == []


@pytest.mark.parametrize("replica", ["Pending", "Running"])
@pytest.mark.parametrize("phase", ["Failed", None])
def test_a_pod_that_will_come_again_is_not_robbed_of_its_volume(scene, phase, replica):
    """The Job waits before it creates the next pod, which then needs the volume."""
    scene.phase, scene.replica = phase, {"phase": replica}

    with pytest.raises(NotFetched, match="job job: replica 0 is about to be started again"):
        scene.fetch()
    assert scene.asked("POST", "/pods") == []


def test_the_first_pod_is_not_robbed_of_its_volume_either(scene):
    """The Job may exist before its first pod, which then needs the volume."""
    scene.replica = {"phase": "Pending", "pod": None}

    with pytest.raises(NotFetched, match="job job: replica 0 is about to be started, "):
        scene.fetch()
    assert scene.asked("POST", "/pods") == []


def test_the_error_for_a_run_that_went_with_its_pod_names_the_field(scene):
    """An ephemeral run has no claim, so the user must change this field before the next run."""
    scene.ephemeral = True

    with pytest.raises(NotFetched, match=r"spec\.storage\.ephemeral"):
        scene.fetch()


def test_a_pod_that_does_not_start_is_deleted_and_the_error_has_the_reason(scene):
    """The user needs the kubelet's message to know why the pod did not start."""
    scene.reader = {"phase": "Pending", "containerStatuses": [{"state": {"waiting": WAITING}}]}

    with pytest.raises(TookTooLong, match="ErrImagePull: no such image"):
        scene.fetch(deadline_s=1.0)

    [made] = scene.asked("POST", "/pods")
    assert len(scene.asked("DELETE", made.body["metadata"]["name"])) == 1


def test_the_command_writes_the_report_of_a_run_whose_trainer_was_killed(scene, tmp_path, capsys):
    """Such a trainer writes neither `end.json` nor a report, but a user of `fetch` wants a report."""
    scene.execution = command(*tar({name: (FINISHED / name).read_bytes() for name in KEPT}), SUCCESS)
    kubeconfig = f"--kubeconfig={tmp_path / 'kubeconfig'}"

    assert main(["fetch", "job", kubeconfig, f"--dir={scene.into}"]) == 0

    report = scene.into / "job/0/report.html"
    assert "<html" in report.read_text()
    assert str(report) in capsys.readouterr().out
