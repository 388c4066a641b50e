"""Films of the best policy's episodes in TensorBoard, seen from above."""

from __future__ import annotations

import json
from io import BytesIO
from itertools import count

import pytest
from PIL import Image
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader
from tensorboard.util.img_mime_type_detector import from_bytes

from palaestra_trainer.job.run_directory import read_lines
from palaestra_trainer.reporting.film import MOST_BYTES
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.run import best_model
from palaestra_trainer.run.best_record import best_of

EVALUATION = {"everySteps": 40, "episodes": 4, "confirmEpisodes": 4}


def shown(directory):
    """Return the films that TensorBoard reads, by name and step."""
    [path] = directory.tensorboard.iterdir()
    return {
        (value.tag, event.step): value.tensor.string_val[2]  # the first two strings are width and height
        for event in EventFileLoader(str(path)).Load()
        for value in event.summary.value
        if value.metadata.plugin_data.plugin_name == "images"
    }


@pytest.fixture
def located(make_member):
    """Return a function that makes simulators whose robots drive on a floor."""

    def make(*arguments, **options):
        member = make_member(*arguments, **options)
        walked = count()
        member.sight = lambda: Sight(
            pose=Pose(next(walked) % 10 / 5, 0.0, 0.0),
            target=(2.0, 0.0),
            floor=None,
            radius_m=0.2,
            period_s=0.1,
        )
        return member

    return make


class TestRobotsOnAFloor:
    """Runs whose simulators report the poses of their robots."""

    @pytest.fixture
    def make_member(self, located):
        """Return the function that replaces the fixture in `play`."""
        return located

    def test_each_new_best_policy_is_shown_at_its_step(self, play, job, directory):
        """A person sees in TensorBoard what the robot has learned since the last film.

        The last films are those of the confirmation.
        """
        play(job(evaluation=EVALUATION))

        films = shown(directory)
        steps = sorted({step for _, step in films})
        evaluated = [line["step"] for line in read_lines(directory.evaluations)]
        assert steps[0] == evaluated[0]
        assert steps[-1] == 100
        assert ("episodes/best", 100) in films

    def test_a_film_is_a_small_gif_that_moves(self, play, job, directory):
        """A browser shows a GIF without a plugin. TensorBoard loads ten films of each name."""
        play(job(evaluation=EVALUATION))

        films = shown(directory)
        assert films
        for film in films.values():
            assert from_bytes(film) == "image/gif"
            assert len(film) < MOST_BYTES
            assert Image.open(BytesIO(film)).n_frames > 1

    @pytest.fixture
    def killed_while_recording(self, monkeypatch):
        """Return a function that lets a run end when it saves the episodes of its n-th best policy."""
        keep = best_model.keep_replays

        def kill(number):
            calls = count(1)

            def kept(*arguments):
                if next(calls) == number:
                    raise ZeroDivisionError("as good as a kill")
                return keep(*arguments)

            monkeypatch.setattr(best_model, "keep_replays", kept)

        return kill

    def test_episodes_of_an_earlier_policy_are_removed_before_model_zip_changes(
        self, play, job, directory, killed_while_recording
    ):
        """A kill may come between the two files. Then no episodes are better than those of another policy."""
        killed_while_recording(2)
        steps = []

        play(
            job(evaluation=EVALUATION),
            on_step=lambda: steps.append(1),
            report=lambda *_: {"is_success": len(steps) > 45},
        )

        assert best_of(directory).step == 80
        assert not directory.replays.exists()

    def test_a_resumed_run_saves_the_episodes_of_the_policy_that_it_evaluates_again(
        self, play, job, directory, killed_while_recording
    ):
        """The policy is not better than itself, but its episodes were not saved before the kill."""
        once = job(evaluation={"everySteps": 80, "episodes": 4, "confirmEpisodes": 0})
        killed_while_recording(1)
        play(once, report=lambda *_: {"is_success": True}, step_reward=0.0)

        play(once, report=lambda *_: {"is_success": True}, step_reward=0.0)

        step = best_of(directory).step
        assert json.loads(directory.replays.read_text())["of"] == f"the evaluation at step {step}"


def test_a_run_without_recordings_shows_no_film(play, job, directory):
    """A robot that stands on no floor has no picture from above."""
    play(job(evaluation=EVALUATION))

    assert shown(directory) == {}
