"""A view reads the simulators of a run from sidecars on this machine, or through an API server."""

import json
from http import HTTPStatus
from pathlib import Path

import pytest
import yaml

from palaestra.api import validate
from palaestra.cluster.errors import Forbidden, from_status
from palaestra.live_view.cluster_job import ClusterJob
from palaestra.live_view.local_run import LocalRun, NoRun
from palaestra.live_view.source import (
    EpisodeReader,
    NotNow,
    NotShown,
    SidecarSource,
    StatusReader,
    of_either,
)
from palaestra_protocol.camera_picture import CameraPicture
from palaestra_protocol.http import Address, Server, error_response, json_response
from palaestra_protocol.pod.status import TrainerStatus
from palaestra_protocol.scene import SceneState, VisibleNode, VisibleScene

EXAMPLE = Path(__file__).parents[3] / "manifests/examples/two-collectors.yaml"
ARENA = VisibleScene(world="arena.wbt", revision=1, nodes=(VisibleNode(name="world"),))
MOVED = SceneState(time_s=1.5, revision=1)
RUN = TrainerStatus(step=10, target=100, episodes=1, phase="collecting", success_rate=0.5)
PLAYED = SceneState(time_s=0.0, episode=7, step=3, rewards={"progress": 0.5})


@pytest.fixture
def serve():
    """Yield a function that serves responses on the loopback address and returns the server's address."""
    servers = []

    def start(**routes):
        table = {("GET", f"/{name}"): (lambda _, answer=answer: answer) for name, answer in routes.items()}
        server = Server(Address("127.0.0.1", 0), table, name="test")
        server.start()
        servers.append(server)
        return str(server.address)

    yield start
    for server in servers:
        server.close()


@pytest.fixture
def run(tmp_path):
    """Return a function that writes the configuration of a run and returns its folder."""

    def write(sidecar, trainer="127.0.0.1:9", replica="0"):
        folder = tmp_path / "runs" / "job" / replica
        folder.mkdir(parents=True)
        content = {
            "statusAddress": trainer,
            "simulators": [{"name": "collect-0", "control": f"http://{sidecar}"}],
        }
        (folder / "training.yaml").write_text(yaml.safe_dump(content))
        return folder

    return write


def answer(message):
    """Return an HTTP response with a message."""
    return json_response(HTTPStatus.OK, message.to_json())


def test_a_run_of_this_machine_is_read_from_its_sidecars_and_its_trainer(serve, run):
    """The trainer reports the episode, and the sidecar reports the poses."""
    trainer = serve(watch=json_response(HTTPStatus.OK, {"collect-0": PLAYED.to_json()}), status=answer(RUN))
    folder = run(serve(scene=answer(ARENA), watch=answer(MOVED)), trainer)

    for given in (folder, folder.parent):
        (source,) = LocalRun(given).sources()

        assert source.scene() == ARENA
        state = source.state()
        assert (state.time_s, state.episode, state.step, state.rewards) == (1.5, 7, 3, {"progress": 0.5})
        assert source.progress() == RUN


def test_a_trainer_between_two_attempts_hides_no_simulator(serve, run):
    """The view needs the poses, but can do without the episode."""
    (source,) = LocalRun(run(serve(watch=answer(MOVED)))).sources()

    assert source.state() == MOVED
    assert source.progress() is None


PICTURE = CameraPicture(name="eye", width=1, height=1, pixels=b"rgb")


@pytest.mark.parametrize(
    ("served", "picture"),
    [
        ({"camera": answer(PICTURE)}, PICTURE),
        ({"camera": json_response(HTTPStatus.OK, None)}, None),
        ({"camera": json_response(HTTPStatus.OK, {"name": "eye"})}, None),
        ({}, None),
    ],
    ids=["one", "none", "nonsense", "older release"],
)
def test_a_picture_is_read_where_a_camera_has_sent_one(serve, run, served, picture):
    """Most robots have no camera, and the rest of the page works without images."""
    (source,) = LocalRun(run(serve(**served))).sources()

    assert source.picture() == picture


@pytest.mark.parametrize(
    ("status", "error", "fact"),
    [
        (HTTPStatus.NOT_FOUND, NotShown, "collect-0: driver webots describes no world"),
        (HTTPStatus.SERVICE_UNAVAILABLE, NotNow, "collect-0: driver webots describes no world"),
    ],
)
def test_the_sentence_of_a_sidecar_is_passed_on(serve, run, status, error, fact):
    """Only the sidecar can report why it has no scene."""
    (source,) = LocalRun(
        run(serve(scene=error_response(status, "driver webots describes no world")))
    ).sources()

    with pytest.raises(error, match=fact):
        source.scene()


def test_an_older_sidecar_and_a_dead_one_are_told_apart(serve, run):
    """An older sidecar will never serve a scene, but a dead one may be restarted."""
    (old,) = LocalRun(run(serve(state=answer(MOVED)))).sources()
    with pytest.raises(NotShown, match="is not one of /state"):
        old.scene()

    dead = SidecarSource(name="collect-0", fetch=lambda *_: (_ for _ in ()).throw(ConnectionRefusedError))
    with pytest.raises(NotNow, match="does not respond"):
        dead.scene()


def test_nonsense_of_a_pod_is_refused(serve, run):
    """A program in a pod may send any response."""
    (source,) = LocalRun(run(serve(scene=answer(MOVED)))).sources()

    with pytest.raises(NotShown, match="invalid response to /scene: world: is missing"):
        source.scene()


def test_a_folder_that_is_no_run_is_refused_with_the_one_to_give(run, tmp_path):
    """The command reports the mistake before it opens a page."""
    with pytest.raises(NoRun, match="give runs/JOB/REPLICA"):
        LocalRun(tmp_path)

    first, second = run("127.0.0.1:9"), run("127.0.0.1:9", replica="1")
    with pytest.raises(NoRun, match=f"name one of their folders: {first}, {second}"):
        LocalRun(first.parent)


def test_a_trainer_is_asked_a_few_times_a_second():
    """The trainer's thread that responds also trains, so requests slow down the training."""
    now, asked = [0.0], []

    def fetch(path, _most):
        asked.append(path)
        return HTTPStatus.OK, json.dumps({"collect-0": PLAYED.to_json()}).encode()

    episodes = EpisodeReader(fetch, clock=lambda: now[0])
    for now[0] in (10.0, 10.1, 10.15, 10.3):
        assert episodes.of("collect-0") == PLAYED

    assert asked == ["watch", "watch"]


def test_the_progress_of_a_run_is_asked_once_a_second():
    """The page draws many times a second, but a person reads numbers more slowly."""
    now, asked = [0.0], []

    def fetch(path, _most):
        asked.append(path)
        return HTTPStatus.OK, json.dumps(RUN.to_json()).encode()

    run = StatusReader(fetch, clock=lambda: now[0])
    for now[0] in (10.0, 10.5, 10.9, 11.1):
        assert run.newest() == RUN

    assert asked == ["status", "status"]


POD = {"name": "job-0-abc", "uid": "1", "created": "2026-01-01T00:00:00Z"}


def test_a_standby_is_seen_after_it_has_taken_over():
    """Only one of a sidecar's two simulators is in use, and the trainer selects it."""
    running = {"standby/watch"}
    asked = []

    def fetch(path, _most):
        asked.append(path)
        found = path in running
        return (HTTPStatus.OK if found else HTTPStatus.SERVICE_UNAVAILABLE), b"{}"

    either = of_either(fetch)
    assert [either("watch", 9)[0] for _ in range(3)] == [503, 200, 200]

    running.add("watch")
    running.remove("standby/watch")
    assert [either("watch", 9)[0] for _ in range(2)] == [503, 200]
    assert asked == ["watch", "standby/watch", "standby/watch", "standby/watch", "watch"]


class FakeClient:
    """A cluster's client with one job of two groups; the job's pod responds through the API server."""

    namespace = "lab"

    def __init__(self, job, answers):
        self.api = self
        self._job = job
        self._answers = answers

    def get(self, _name):
        """Return the job."""
        return self._job

    def proxied(self, namespace, pod, port, path):
        """Return the response of the pod, or raise the error of the API server."""
        found = self._answers[port, path]
        if isinstance(found, Exception):
            raise found
        assert (namespace, pod) == ("lab", "job-0-abc")
        return found


def test_a_job_is_read_from_the_newest_pod_of_its_replica():
    """Only the newest pod of a replica still runs.

    The health ports of the simulators follow the order of the groups.
    """
    content = yaml.safe_load(EXAMPLE.read_bytes())
    content["metadata"]["uid"] = "7d3b8a54-0000-4000-8000-000000000000"
    content["status"] = {"replicas": [{"index": 0, "pod": POD}]}
    client = FakeClient(
        validate(content, "two-collectors"),
        {
            (7201, "scene"): json.dumps(ARENA.to_json()),
            (7201, "watch"): json.dumps(MOVED.to_json()),
            (9090, "watch"): json.dumps({"collect-1": PLAYED.to_json()}),
            (9090, "status"): json.dumps(RUN.to_json()),
        },
    )

    sources = ClusterJob(client, "two-collectors", 0).sources()

    assert [source.name for source in sources] == ["collect-0", "collect-1", "evaluate-0"]
    assert sources[1].scene() == ARENA
    assert sources[1].state().episode == 7
    assert sources[1].progress() == RUN


def test_the_error_of_a_server_behind_the_api_server_keeps_its_sentence():
    """The API server passes on the body of a pod's response, in which our servers set `error`."""
    error = from_status(404, {"error": "driver webots describes no world"})

    assert (error.reason, error.message) == ("HTTP404", "driver webots describes no world")


@pytest.mark.parametrize(
    ("failure", "error"),
    [
        (from_status(404, {"error": "no world"}), NotShown),
        (from_status(503, {"error": "the simulator does not run"}), NotNow),
        (from_status(404, {"reason": "NotFound", "message": "pods not found"}), NotNow),
        (Forbidden(403, "Forbidden", "pods/proxy"), NotShown),
    ],
)
def test_a_pod_is_read_through_the_api_server(failure, error):
    """A user's machine usually cannot reach the network of pods.

    If the pod is gone, another pod may follow.
    """
    job = ClusterJob(FakeClient(None, {(7200, "scene"): failure, (7200, "watch"): "{}"}), "job", 0)
    source = SidecarSource(
        name="collect-0", fetch=lambda path, most: job._fetch("job-0-abc", 7200, path, most)
    )

    with pytest.raises(error):
        source.scene()
