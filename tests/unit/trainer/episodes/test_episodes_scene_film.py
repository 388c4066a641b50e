"""Recordings of episodes in three dimensions: bounded, and only of what the evaluation has seen."""

from __future__ import annotations

import json

import pytest

from palaestra_protocol.scene import (
    SceneState,
    ShapeKind,
    Triangles,
    VisibleNode,
    VisibleScene,
    VisualShape,
)
from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.scene_film import (
    MOST_FRAMES,
    MOST_NUMBERS,
    NotFilmed,
    SceneFilming,
    characters,
    lightened,
)
from palaestra_trainer.episodes.second_play import record_again
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.read_replays import replays_of
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.run.replays import keep_replays
from palaestra_trainer.simulators.restarter import Restarter, await_one

BOX = VisualShape(kind=ShapeKind.BOX, size=(0.1, 0.2, 0.3))


def at(x):
    """Return a pose at x meters."""
    return (float(x), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


class World:
    """A simulator with a wall, in which `moving` nodes are `at` meters from their start."""

    def __init__(self, moving=1, revision=lambda _step: 1):
        self.names = [f"robot {number}" for number in range(moving)]
        self.at = 0
        self.revision = revision

    def sight(self):
        """Return the position of a robot that stands still."""
        return Sight(pose=Pose(0.0, 0.0, 0.0), target=None, floor=None, radius_m=0.2, period_s=0.1)

    def visible_scene(self):
        """Return the shapes."""
        nodes = [VisibleNode(name="wall", shapes=(BOX,))]
        nodes += [VisibleNode(name=name, moves=True, shapes=(BOX,)) for name in self.names]
        return VisibleScene(world="any", revision=1, nodes=tuple(nodes))

    def visible_state(self):
        """Return the poses of the robots."""
        poses = {name: at(self.at) for name in self.names}
        return SceneState(time_s=0.1 * self.at, revision=self.revision(self.at), poses=poses)


class Right:
    """A policy that walks right."""

    def predict(self, observation, state=None, episode_start=None, *, deterministic=False):
        """Return the action, and the state unchanged."""
        del observation, episode_start, deterministic
        return 1, state


@pytest.fixture
def member(make_member):
    """Return a simulator with a corridor, whose world can be recorded."""
    found, world = make_member(), World()
    found.sight, found.visible_scene, found.visible_state = (
        world.sight,
        world.visible_scene,
        world.visible_state,
    )
    return found


def filmed(world, looks):
    """Return the film of nodes that drive one meter between two looks."""
    filming = SceneFilming(world)
    for world.at in range(looks):
        filming.look()
    return filming.film()


@pytest.mark.parametrize(("moving", "looks"), [(1, 3), (1, 7 * MOST_FRAMES), (30, 400)])
def test_a_recording_has_the_moving_nodes_in_a_bounded_size(moving, looks):
    """Three recordings must fit into a report, however long an episode is and however much moves."""
    film = filmed(World(moving), looks)

    assert film.nodes == tuple(f"robot {number}" for number in range(moving))
    assert 7 * moving * len(film.frames) <= MOST_NUMBERS
    assert looks <= 3 or 7 * moving * len(film.frames) > MOST_NUMBERS / 5
    distance = film.frames[1][0][0]
    assert [frame[0] for frame in film.frames] == [at(distance * n) for n in range(len(film.frames))]


@pytest.mark.parametrize(
    ("world", "reason"),
    [
        (World(2000), "too many for a report"),
        (World(revision=lambda step: 1 + step // 2), "the shapes of the world changed"),
    ],
)
def test_a_world_that_a_report_cannot_show_is_refused(world, reason):
    """A recording with missing parts or old shapes would show what did not happen."""
    with pytest.raises(NotFilmed, match=reason):
        filmed(world, 4)


def test_the_largest_meshes_become_boxes_around_them():
    """The size of a report is bounded; a box shows at least where the thing is."""
    large = Triangles(points=tuple((0.1 * n, 1.0, 0.0) for n in range(101)), triangles=((0, 1, 2),) * 50)
    small = Triangles(points=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), triangles=((0, 1, 2),))
    turned = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # half a turn about z
    shapes = [
        VisualShape(kind=ShapeKind.MESH, size=(1.0, 2.0, 1.0), mesh=mesh, pose=turned) for mesh in (0, 1)
    ]
    scene = VisibleScene(
        world="any", revision=1, nodes=(VisibleNode(name="it", shapes=tuple(shapes)),), meshes=(large, small)
    )

    lighter = lightened(scene, characters(scene) - 1)

    box, mesh = lighter.nodes[0].shapes
    assert (box.kind, box.mesh, lighter.simplified) == (ShapeKind.BOX, None, 1)
    assert box.size == pytest.approx((10.0, 0.0, 0.0))
    assert box.pose[:3] == pytest.approx((0.0, -2.0, 0.0))
    assert (mesh.mesh, lighter.meshes) == (0, (small,))
    with pytest.raises(NotFilmed, match="too many shapes"):
        lightened(scene, 100)


def test_an_episode_is_recorded_again_from_the_reset_to_the_end(member, tmp_path):
    """The file has what the report needs: the scene once, and the poses of each episode."""
    evaluation = evaluate(Right(), member, [10, 12])
    restarter = Restarter(member)

    keep_replays(
        RunDirectory(tmp_path), evaluation, "a test", lambda game: record_again(Right(), [restarter], game)
    )

    content = json.loads((tmp_path / "replays.json").read_text())
    replays = list(replays_of(content))
    assert len(content["scenes"]) == 1
    assert [replay.title for replay in replays] == ["best", "worst"]
    assert [(replay.space.nodes, len(replay.space.frames)) for replay in replays] == [((), 4)] * 2


def test_an_episode_that_ends_differently_is_not_shown_as_the_evaluated_one(member):
    """A simulator may have a reset that is not exact; its second episode was never evaluated."""
    [episode] = evaluate(Right(), member, [10]).episodes
    member.env.step_reward = -0.2

    with pytest.raises(NotFilmed, match="drove differently"):
        record_again(Right(), [Restarter(member)], (0, episode))


def test_a_fault_in_the_recording_costs_the_recording_and_not_the_run(make_member, member):
    """The evaluation is complete, so the run continues with a restarted simulator."""
    [episode] = evaluate(Right(), member, [10]).episodes
    broken = make_member(steps={2: SimulatorDead("evaluate-0", "gone")})
    broken.visible_scene, broken.visible_state = member.visible_scene, member.visible_state
    restarter = Restarter(broken)

    with pytest.raises(NotFilmed, match="gone"):
        record_again(Right(), [restarter], (0, episode))

    await_one([restarter])
    assert restarter.up()


def test_a_simulator_that_does_not_describe_its_world_is_named_as_the_reason(make_member):
    """Webots is such a simulator; the page then has the view from above."""
    plain = make_member()
    [episode] = evaluate(Right(), plain, [10]).episodes

    with pytest.raises(NotFilmed, match="does not describe its world"):
        record_again(Right(), [Restarter(plain)], (0, episode))
