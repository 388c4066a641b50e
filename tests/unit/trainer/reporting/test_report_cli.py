"""The command `palaestra-report`, which writes reports and films."""

from __future__ import annotations

import json
import sys

import av
import pytest
from PIL import Image

from palaestra_trainer.cli.report import main

DRIVE = {
    "frame_s": 0.2,
    "radius_m": 0.2,
    "poses": [[0.1 * step, 0.05 * step, 0.5] for step in range(20)],
    "targets": [[0, 1.9, 0.9]],
    "low": [-1.0, -1.0],
    "high": [3.0, 2.0],
    "obstacles": [[1.0, -0.5, 0.2, 0.1, 0.05, 0.3], [0.0, 1.0, 0.0, 0.0, 0.2, 0.0]],
}


@pytest.fixture
def run(tmp_path):
    """Return a run directory with one recorded episode."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "training.yaml").write_text("job: arena\n")
    (folder / "replays.json").write_text(json.dumps({"episodes": [{"title": "best", "film": DRIVE}]}))
    return folder


def test_one_run_is_reported_in_its_directory_and_several_where_the_person_says(tmp_path, capsys):
    """The command prints the path, so a script can open the report."""
    for name in ("0", "1"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "training.yaml").write_text("job: arena\n")

    one = main([str(tmp_path / "0")])
    several = main([str(tmp_path / "0"), str(tmp_path / "1"), "--out", str(tmp_path / "both.html")])

    assert (one, several) == (0, 0)
    assert capsys.readouterr().out.splitlines() == [
        str(tmp_path / "0" / "report.html"),
        str(tmp_path / "both.html"),
    ]
    assert "2 runs side by side" in (tmp_path / "both.html").read_text()


def test_a_folder_that_is_not_a_run_is_named(tmp_path, capsys):
    """If one folder is wrong, no report is written for the others either."""
    (tmp_path / "training.yaml").write_text("job: arena\n")

    code = main([str(tmp_path), str(tmp_path / "none")])

    assert code == 2
    assert "none: has no training.yaml; give a run directory" in capsys.readouterr().err
    assert not (tmp_path / "report.html").exists()


def test_a_place_that_cannot_be_written_is_named(tmp_path, capsys):
    """The folder may be missing or read-only, so the message asks for another file with `--out`."""
    (tmp_path / "training.yaml").write_text("job: arena\n")

    code = main([str(tmp_path), "--out", str(tmp_path / "none" / "report.html")])

    assert code == 1
    assert "choose another file with --out" in capsys.readouterr().err


def test_the_best_episode_is_written_as_an_animated_gif(run, tmp_path, capsys):
    """A person can paste a GIF into a message or a web page."""
    code = main([str(run), "--film", str(tmp_path / "best.gif")])

    assert (code, capsys.readouterr().out) == (0, f"{tmp_path / 'best.gif'}\n")
    with Image.open(tmp_path / "best.gif") as film:
        assert (film.n_frames, film.size) == (20, (360, 276))
        assert film.info["duration"] == 150
        film.seek(19)
        assert film.convert("RGB").getpixel((246, 106)) == (31, 95, 191)  # a pixel of the robot
    assert not (run / "report.html").exists()


def test_the_best_episode_is_written_as_a_video_that_plays_as_fast_as_it_was(run, tmp_path):
    """Each recorded pose is a frame that lasts 0.2 s, so the video has 5 frames per second."""
    assert main([str(run), "--film", str(tmp_path / "best.mp4")]) == 0

    with av.open(str(tmp_path / "best.mp4")) as film:
        [stream] = film.streams
        assert (stream.codec_context.name, stream.frames, stream.average_rate) == ("h264", 20, 5)


def test_a_run_without_recorded_episodes_has_no_film(run, tmp_path, capsys):
    """The command must not overwrite or delete an older film."""
    (run / "replays.json").unlink()
    (tmp_path / "best.gif").write_text("old")

    code = main([str(run), "--film", str(tmp_path / "best.gif")])

    assert code == 2
    assert "run: has no recorded episode; set evaluation.everySteps" in capsys.readouterr().err
    assert (tmp_path / "best.gif").read_text() == "old"


@pytest.mark.parametrize(
    ("name", "code", "problem"),
    [
        ("best.avi", 2, "best.avi: a film is a GIF or an MP4; give a name that ends in .gif or .mp4"),
        ("none/best.gif", 1, "best.gif: No such file or directory; choose another file with --film"),
        ("none/best.mp4", 1, "best.mp4: No such file or directory; choose another file with --film"),
    ],
)
def test_a_film_that_cannot_be_written_is_named(run, tmp_path, capsys, name, code, problem):
    """The message asks for another file with `--film`, or for a name that ends in .gif or .mp4."""
    assert main([str(run), "--film", str(tmp_path / name)]) == code
    assert problem in capsys.readouterr().err


def test_a_film_shows_one_run(run, tmp_path, capsys):
    """A film of a second run would need a second file name."""
    assert main([str(run), str(run), "--film", str(tmp_path / "best.gif")]) == 2
    assert "a film shows one run; give one run directory" in capsys.readouterr().err


def test_an_mp4_without_pyav_says_what_to_install(run, tmp_path, capsys, monkeypatch):
    """PyAV has 36 MB and is needed only for MP4 files, so it is optional."""
    monkeypatch.setitem(sys.modules, "av", None)

    assert main([str(run), "--film", str(tmp_path / "best.mp4")]) == 2
    assert "install palaestra-trainer[film]" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
