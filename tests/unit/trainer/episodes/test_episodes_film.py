"""Films of evaluation episodes, seen from above, in a bounded size."""

from __future__ import annotations

import pytest

from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.film import MOST_FRAMES, Filming
from palaestra_trainer.episodes.scene_film import NotFilmed
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.layout import FloorLayout, Obstacle
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.run.replays import chosen, keep_replays

FLOOR = FloorLayout(
    low=(-2.0, -2.0),
    high=(2.0, 2.0),
    obstacles=(Obstacle(name="POLE", x_m=1.0, y_m=0.0, bottom_m=0.0, top_m=1.0, radius_m=0.2),),
)


class Walked:
    """A simulator whose robot is `at` meters from its start.

    The target jumps when the robot has driven `moves` meters.
    """

    def __init__(self, moves: int = 10**9) -> None:
        self.moves = moves
        self.at = 0

    def sight(self):
        """Return the pose of the robot and the position of the target."""
        target = (9.0, 0.0) if self.at >= self.moves else (3.0, 0.0)
        pose = Pose(float(self.at), 0.0, 0.5)
        return Sight(pose=pose, target=target, floor=FLOOR, radius_m=0.2, period_s=0.1)


class RightWalker:
    """A policy that walks right if the seed's last digit is even, and otherwise left."""

    def predict(self, observation, state=None, episode_start=None, *, deterministic=False):
        """Return the action, and the state unchanged."""
        del episode_start, deterministic
        return int(round(float(observation[1]) * 10) % 2 == 0), state


def no_space(_game):
    """Refuse a recording in three dimensions."""
    raise NotFilmed("a test")


def record(member, looks):
    """Return the film of a robot that drives one meter between looks."""
    filming = Filming(member)
    for at in range(looks):
        if member:
            member.at = at
        filming.look()
    return filming.film()


def test_a_film_has_each_pose_the_floor_and_the_target():
    """The replay in a report is made of these values alone."""
    content = record(Walked(moves=2), 4).to_json()

    assert content["poses"] == [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [2.0, 0.0, 0.5], [3.0, 0.0, 0.5]]
    assert content["targets"] == [[0, 3.0, 0.0], [2, 9.0, 0.0]]
    assert content["obstacles"] == [[1.0, 0.0, 0.0, 0.0, 0.2, 0.0]]
    assert (content["low"], content["high"]) == ([-2.0, -2.0], [2.0, 2.0])
    assert (content["frame_s"], content["radius_m"]) == (0.1, 0.2)


@pytest.mark.parametrize("looks", [MOST_FRAMES, MOST_FRAMES + 1, 2 * MOST_FRAMES + 2, 20_000])
def test_a_long_episode_takes_no_more_space_than_a_short_one(looks):
    """A film has a largest number of frames, so the frames of a long episode are further apart."""
    film = record(Walked(), looks)

    content = film.to_json()
    assert MOST_FRAMES / 2 <= len(content["poses"]) <= MOST_FRAMES
    distance = content["poses"][1][0]
    assert [pose[0] for pose in content["poses"]] == [distance * n for n in range(len(content["poses"]))]
    assert film.frame_s == pytest.approx(0.1 * distance)


def test_a_member_that_is_on_no_floor_is_not_recorded(make_member):
    """A robot without a pose cannot be filmed; the report then has only its other parts."""
    [episode] = evaluate(RightWalker(), make_member(), [10]).episodes

    assert episode.film is None
    assert record(None, 3) is None


def test_an_evaluation_records_its_episodes_from_the_reset_to_the_end(make_member):
    """A person must see where the robot starts and where it ends."""
    member = make_member()
    member.sight = Walked().sight

    evaluation = evaluate(RightWalker(), member, [10, 21])

    assert [len(episode.film.to_json()["poses"]) for episode in evaluation.episodes] == [4, 9]


def test_the_best_a_median_and_a_failed_episode_are_kept(make_member, tmp_path):
    """These films show what the policy can do, what it usually does, and what it still does wrong."""
    member = make_member()
    member.sight = Walked().sight
    evaluation = evaluate(RightWalker(), member, [10, 12, 21])

    keep_replays(RunDirectory(tmp_path), evaluation, "a test", no_space)

    assert [title for title, _ in chosen(evaluation.episodes)] == ["best", "median", "failed"]
    assert [episode.success for _, episode in chosen(evaluation.episodes)] == [True, True, False]
    assert (tmp_path / "replays.json").stat().st_size < 2000


def test_no_episode_is_kept_twice(make_member):
    """A single episode is the best, the median and the worst episode at once."""
    member = make_member()
    member.sight = Walked().sight

    assert [title for title, _ in chosen(evaluate(RightWalker(), member, [10]).episodes)] == ["best"]


def test_an_evaluation_without_recordings_writes_no_file(make_member, tmp_path):
    """The report then has no section for films."""
    keep_replays(RunDirectory(tmp_path), evaluate(RightWalker(), make_member(), [10]), "a test", no_space)

    assert not RunDirectory(tmp_path).replays.exists()
