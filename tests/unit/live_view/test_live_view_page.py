"""The page of a live view: what it draws of a scene, and which requests it sends to a simulator."""

import signal
import threading

import msgspec
import pytest
import viser
from websockets.sync.client import connect

from palaestra.live_view.page import ViewPage, described, summarized
from palaestra.live_view.source import NotNow
from palaestra.live_view.stage import capsule
from palaestra_protocol.camera_picture import CameraPicture
from palaestra_protocol.pod.status import SuccessInterval, TrainerStatus
from palaestra_protocol.scene import (
    SceneState,
    ShapeKind,
    Triangles,
    VisibleNode,
    VisibleScene,
    VisualShape,
)
from tests.waiting import eventually

WEDGE = Triangles(points=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), triangles=((0, 1, 2),))
SHAPES = tuple(
    VisualShape(kind=kind, size=(0.1, 0.1, 0.3), mesh=0 if kind is ShapeKind.MESH else None)
    for kind in ShapeKind
)
RUN = TrainerStatus(
    step=12_000,
    target=50_000,
    episodes=90,
    phase="collecting",
    success_rate=0.85,
    success_interval=SuccessInterval(low=0.64, high=0.95, episodes=20),
    faults={"dead": 2, "slow": 5},
)
AT = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
THERE = (2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


class Simulator:
    """A fake simulator with a robot that has every shape, and a mark that the scene may move."""

    name = "collect-0"

    def __init__(self, *, here=True):
        self.here = here
        self.signals = []
        self.asked = 0
        self.revision = 1
        self.failing = False
        self.poses = {"robot": THERE}
        self.shot = None

    def signal(self, number):
        """Record a signal."""
        self.signals.append(number)

    def scene(self):
        """Return the scene of this simulator."""
        nodes = (
            VisibleNode(name="mark", pose=AT, shapes=SHAPES[:1]),
            VisibleNode(name="robot", moves=True, robot=True, shapes=SHAPES),
        )
        return VisibleScene(world="w", revision=self.revision, nodes=nodes, meshes=(WEDGE,))

    def state(self):
        """Return the current state of this simulator."""
        self.asked += 1
        if self.failing:
            raise NotNow("collect-0: the simulator does not run")
        return SceneState(time_s=1.5, revision=self.revision, poses=dict(self.poses), episode=7)

    def picture(self):
        """Return the current image of this simulator's camera."""
        self.asked += 1
        return self.shot

    def progress(self):
        """Return the progress of the run."""
        return RUN


@pytest.fixture
def simulator():
    """Return a fake simulator."""
    return Simulator()


@pytest.fixture
def page(simulator):
    """Yield the page of the simulator, which runs in a thread."""
    shown = ViewPage("test", lambda: (simulator,), 0)
    ended = threading.Event()
    thread = threading.Thread(target=shown.run, args=(ended.is_set,))
    thread.start()
    yield shown
    ended.set()
    thread.join(10.0)
    shown.close()


@pytest.fixture
def browser(page):
    """Yield after a browser has opened the page and reported its camera."""
    address = page.address.removeprefix("http://")
    camera = {
        "type": "ViewerCameraMessage",
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (0.0, 0.0, 1.0),
        "look_at": (0.0, 0.0, 0.0),
        "up_direction": (0.0, 0.0, 1.0),
        "fov": 1.0,
        "near": 0.1,
        "far": 10.0,
        "image_height": 10,
        "image_width": 10,
    }
    with connect(
        f"ws://{address}", origin=page.address, subprotocols=[f"viser-v{viser.__version__}"], max_size=None
    ) as one:
        one.send(msgspec.msgpack.encode(camera))
        eventually(page._server.get_clients)
        yield one


def place(page, name):
    """Return the x coordinate of a node on the page; None until the node is drawn."""
    handle = page._stage._nodes.get(name)
    return None if handle is None else float(handle.position[0])


def test_a_page_that_nobody_looks_at_asks_for_nothing(page, simulator):
    """A user may leave the view open over night, and an unwatched view must not slow down the training."""
    threading.Event().wait(0.5)

    assert page.address.startswith("http://127.0.0.1:")
    assert simulator.asked == 0


@pytest.mark.usefixtures("browser")
def test_it_draws_every_shape_and_moves_what_moves(page, simulator):
    """If the state has no pose for a node, the page uses the pose of the scene."""
    eventually(lambda: place(page, "robot") == 2.0)
    assert place(page, "mark") == 1.0

    simulator.poses = {"robot": AT, "mark": THERE}
    eventually(lambda: (place(page, "robot"), place(page, "mark")) == (1.0, 2.0))
    simulator.poses = {"robot": THERE}
    eventually(lambda: place(page, "mark") == 1.0)


@pytest.mark.usefixtures("browser")
def test_the_newest_picture_of_a_camera_is_shown_while_the_simulator_has_one(page, simulator):
    """The user sees the image that the policy gets.

    After a restart the camera may be off, and an old image would mislead the user.
    """
    for red in (1, 2):
        simulator.shot = CameraPicture(name="eye", width=2, height=1, pixels=bytes((red, 0, 0)) * 2)
        eventually(lambda red=red: page._picture is not None and page._picture.image[0, 0, 0] == red)
    assert page._picture.label == "eye"

    simulator.shot = None
    eventually(lambda: page._picture is None)


@pytest.mark.usefixtures("browser")
def test_another_revision_draws_the_scene_again(page, simulator):
    """A supervisor may have added a box, or the simulator may have loaded another world."""
    eventually(lambda: place(page, "robot"))
    before = page._stage._nodes["robot"]

    simulator.revision = 2
    eventually(lambda: page._stage.revision == 2)

    assert page._stage._nodes["robot"] is not before


@pytest.mark.usefixtures("browser")
def test_a_simulator_that_restarts_is_told_and_shown_again(page, simulator):
    """A user opens the page to see how the run recovers from a fault."""
    eventually(lambda: place(page, "robot"))
    simulator.failing = True
    eventually(lambda: "does not run" in page._text.content)
    assert "2 faults" in page._text.content

    simulator.failing = False
    eventually(lambda: "episode 7" in page._text.content)
    assert "stepped again after" in page._text.content


def test_the_first_start_of_a_simulator_is_not_shown_as_a_restart(page, simulator, request):
    """A run without a fault would otherwise seem to have had one."""
    simulator.failing = True
    request.getfixturevalue("browser")
    eventually(lambda: "does not run" in page._text.content)

    simulator.failing = False
    eventually(lambda: "episode 7" in page._text.content)
    assert "stepped again" not in page._text.content


def buttons(page):
    """Return the identifiers of a page's buttons, by label."""
    return {handle.label: identifier for identifier, handle in page._gate._controls.items()}


def test_a_button_kills_the_simulator_of_a_run_of_this_machine(page, simulator, browser):
    """With the buttons a user can see that the training survives a fault."""
    for label in ("kill it", "hang it"):
        update = {"type": "GuiUpdateMessage", "uuid": buttons(page)[label], "updates": {"value": True}}
        browser.send(msgspec.msgpack.encode(update))
        eventually(lambda label=label: len(simulator.signals) == ("kill it", "hang it").index(label) + 1)

    assert simulator.signals == [signal.SIGKILL, signal.SIGSTOP]


def test_a_simulator_of_a_cluster_has_no_such_button():
    """The simulator's process runs in a pod, to which this machine cannot send a signal."""
    shown = ViewPage("test", lambda: (Simulator(here=False),), 0)
    try:
        assert buttons(shown) == {}
    finally:
        shown.close()


def test_names_of_a_pod_are_text_and_nothing_else():
    """A reward term may have any name, and must not become a Markdown link or HTML on the page."""
    state = SceneState(time_s=0.0, rewards={"![x](http://evil)|<b>": 1.0}, joints={"hip": 0.5})

    text = described(state)

    assert not set("<>()[]!") & set(text)
    assert "| hip | 0.500 |" in text


def test_the_success_rate_is_shown_with_its_interval_and_the_faults():
    """A success rate means little without its interval. A slow step does not count as a fault."""
    text = "step 12,000 of 50,000 · 2 faults\n\n**success 85 %** (64 to 95 %, 20 episodes)"

    assert summarized(RUN) == text


def test_a_run_without_an_evaluation_has_no_rate_and_one_between_two_attempts_nothing():
    """The page leaves out unknown values and does not show a zero instead."""
    new = TrainerStatus(step=10, target=100, episodes=1, phase="collecting", faults={"hung": 1})

    assert summarized(new) == "step 10 of 100 · 1 fault"
    assert summarized(None) == ""


def test_a_capsule_has_the_height_with_its_caps():
    """Viser has no capsule shape, so the page draws a mesh, which must have the size of the capsule."""
    points, faces = capsule(0.1, 0.6)

    assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((-0.3, 0.3))
    assert points[:, 0].max() == pytest.approx(0.1, abs=0.01)
    assert faces.max() < len(points)
