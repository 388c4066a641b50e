"""The bag of a run contains the values of its recorded episodes in the order of time."""

import json
import math
import shlex
import sys
from pathlib import Path

import pytest

from palaestra_trainer.bags.reader import read_bag
from palaestra_trainer.cli.export import export
from tests.pages import blocks

PAGE = Path(__file__).parents[4] / "docs/howto/export.md"
RESULTS = {"title": "best", "seed": 7, "outcome": "reached", "success": True, "return": 1.5, "length": 3}
FILM = {
    "frame_s": 0.2,
    "poses": [[0.0, 0.0, 0.0], [0.1, 0.0, 0.5], [0.2, 0.1, 1.0]],
    "targets": [[0, 1.9, 0.9], [2, -1.0, 0.5]],
}
REPLAYS = {
    "of": "the evaluation at step 64",
    "episodes": [RESULTS | {"film": FILM}, {"seed": 9, "film": {"frame_s": 0.5, "poses": [[1.0, 2.0, 3.0]]}}],
}


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Return the run directory of the page, with two recorded episodes, below the working directory."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "runs/move-to-target/0"
    folder.mkdir(parents=True)
    (folder / "replays.json").write_text(json.dumps(REPLAYS))
    return folder


def test_the_command_of_the_page_writes_the_episodes(run, capsys):
    """A reader copies the command from the page."""
    [command] = [text for text in blocks(PAGE.read_text(), "console") if "--to mcap" in text]

    _, verb, *arguments = shlex.split(command.splitlines()[-1])
    code = export(arguments)

    assert (verb, code) == ("export", 0)
    written = {"path": "runs/move-to-target/0/episodes.mcap", "episodes": 2, "messages": 12}
    assert json.loads(capsys.readouterr().out) == written
    assert sorted(path.name for path in run.iterdir()) == ["episodes.mcap", "replays.json"]


def test_the_episodes_follow_each_other_after_a_second(run):
    """A player shows the whole bag as one drive, so a pause of a second separates the episodes."""
    assert export([str(run), "--to", "mcap"]) == 0

    bag = read_bag(run / "episodes.mcap")

    starts = [json.loads(message.content["data"]) for message in bag.topics["/palaestra/episode"]]
    assert starts == [RESULTS | {"start_s": 1.0}, {"seed": 9, "start_s": 2.4}]
    for topic in ("/odom", "/tf"):
        assert [message.stamp_s for message in bag.topics[topic]] == pytest.approx([1.0, 1.2, 1.4, 2.4])
    assert [message.stamp_s for message in bag.topics["/target"]] == pytest.approx([1.0, 1.4])
    assert bag.metadata["of"] == "the evaluation at step 64"
    for messages in bag.topics.values():
        stamps = [message.stamp_s for message in messages]
        assert stamps == sorted(stamps)


def test_the_poses_are_the_recorded_ones_and_the_velocity_is_unknown(run):
    """The recording has no velocity, so the bag must not claim one."""
    export([str(run), "--to", "mcap"])

    topics = read_bag(run / "episodes.mcap").topics

    odometry, transform = topics["/odom"][2].content, topics["/tf"][2].content["transforms"][0]
    assert odometry["pose"]["pose"]["position"] == {"x": 0.2, "y": 0.1, "z": 0.0}
    assert odometry["pose"]["pose"]["orientation"]["z"] == pytest.approx(math.sin(0.5))
    assert odometry["twist"]["covariance"][0] == -1.0
    assert transform["transform"]["translation"] == odometry["pose"]["pose"]["position"]
    assert {part["header"]["frame_id"] for part in (odometry, transform)} == {"map"}
    assert topics["/target"][1].content["pose"]["position"] == {"x": -1.0, "y": 0.5, "z": 0.0}


def test_a_bag_is_replaced_by_the_newer_episodes(run):
    """A resumed run may find a better policy, whose episodes are then those of the run."""
    export([str(run), "--to", "mcap"])
    (run / "replays.json").write_text(json.dumps({"episodes": [RESULTS | {"film": FILM}]}))

    assert export([str(run), "--to", "mcap"]) == 0

    assert len(read_bag(run / "episodes.mcap").topics["/palaestra/episode"]) == 1


@pytest.mark.parametrize("content", ["{}", '{"episodes": [{"seed": 1}]}', "damaged"])
def test_a_run_without_recorded_episodes_is_refused(run, content, capsys):
    """The message names the field of the job that records episodes."""
    (run / "replays.json").write_text(content)

    assert export([str(run), "--to", "mcap"]) == 2

    assert "0: has no recorded episode; set evaluation.everySteps in the job" in capsys.readouterr().err
    assert not (run / "episodes.mcap").exists()


def test_a_recording_with_a_damaged_time_is_refused(run, capsys):
    """Only a damaged file has such a time, and no part of a bag may stay."""
    (run / "replays.json").write_text(json.dumps({"episodes": [{"film": FILM | {"frame_s": 1e12}}]}))

    assert export([str(run), "--to", "mcap"]) == 2

    assert "is not a time of ROS 2" in capsys.readouterr().err
    assert [path.name for path in run.iterdir()] == ["replays.json"]


def test_a_result_that_is_not_a_number_is_left_out(run):
    """JSON of a String message has no NaN."""
    (run / "replays.json").write_text(
        json.dumps({"episodes": [{"seed": 3, "return": math.nan, "film": FILM}]})
    )

    assert export([str(run), "--to", "mcap"]) == 0

    [start] = read_bag(run / "episodes.mcap").topics["/palaestra/episode"]
    assert json.loads(start.content["data"]) == {"seed": 3, "start_s": 1.0}


def test_without_the_library_the_extra_is_named(run, monkeypatch, capsys):
    """The images and a plain installation do not have the library."""
    for module in [name for name in sys.modules if name.startswith("palaestra_trainer.bags.writer")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.delitem(sys.modules, "palaestra_trainer.exporting.bag_file", raising=False)
    monkeypatch.setitem(sys.modules, "mcap.records", None)

    assert export([str(run), "--to", "mcap"]) == 2

    err = capsys.readouterr().err
    assert "--to mcap: cannot be written" in err
    assert "install palaestra-trainer[deploy]" in err
