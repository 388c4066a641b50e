"""The report of a deployment: its record as episodes and decisions."""

import pytest

from palaestra_trainer.bags import definitions, messages
from palaestra_trainer.bags.writer import BagWriter
from palaestra_trainer.cli.report import main
from palaestra_trainer.real_robots.deployment.read_record import read_record

BEGIN_S = 1_700_000_000.0


@pytest.fixture
def bag(tmp_path):
    """Yield a writer of a record, and close it."""
    with BagWriter(tmp_path / "drive.mcap", {"robot": "http://192.0.2.1"}) as writer:
        yield writer


def drive(writer, begin_s, target, *ends):
    """Record a drive of 2 s along x to a target, and decisions at its end."""
    at = BEGIN_S + begin_s
    ends = ({"begin": "episode"}, *ends)
    writer.write("/target", definitions.POSE, messages.target(at, *target), at)
    for frame in range(41):
        stamp_s = at + frame / 20
        content = messages.odometry(stamp_s, (frame / 40, 0.0, 0.5), (0.5, 0.0, 0.0))
        writer.write("/odom", definitions.ODOMETRY, content, stamp_s)
    for stamp_s, facts in zip((at, *[at + 2.0] * len(ends)), ends, strict=False):
        writer.write("/palaestra/decisions", definitions.STRING, messages.record(facts), stamp_s)


REACHED = {"episode": "reached", "steps": 9, "success": True}


def test_each_episode_is_replayed_with_its_target(bag):
    """A person who was not there sees where the robot drove."""
    drive(bag, 0.0, (1.0, 0.0), REACHED)
    drive(bag, 3.0, (0.0, 2.0), REACHED | {"episode": "collided", "success": False})
    bag.close()

    data = read_record(bag.path)

    assert data.figures == {"episodes": "2", "successes": "1"}
    assert data.ended == "failed"
    assert [each.title for each in data.replays] == ["episode 1", "episode 2"]
    assert [each.targets for each in data.replays] == [((0, 1.0, 0.0),), ((0, 0.0, 2.0),)]
    first = data.replays[0]
    assert first.facts == "reached · 2.0 s"
    assert first.frame_s == pytest.approx(0.1)
    assert first.poses[0] == pytest.approx((0.0, 0.0, 0.5))
    assert first.poses[-1] == pytest.approx((1.0, 0.0, 0.5))
    assert data.asked == {"robot": "http://192.0.2.1"}


def test_an_episode_that_a_rule_ended_is_shown_with_its_cause(bag):
    """A person reads the report to find out why the robot stopped."""
    drive(bag, 0.0, (1.0, 0.0), {"decision": "stand", "cause": "fence"})
    bag.close()

    data = read_record(bag.path)

    assert data.figures == {"episodes": "1", "successes": "0", "last cause to stand": "fence"}
    assert data.replays[0].facts.startswith("stopped")
    assert data.decisions[1:] == (("2023-11-14 22:13:22.000+00:00", "decision stand, cause fence"),)


def test_a_dry_run_has_no_episode(bag):
    """The record of a dry run has a target and decisions, but the robot did not drive."""
    bag.close()

    assert read_record(bag.path).replays == ()


def test_the_program_writes_the_report_beside_the_record(bag, capsys):
    """The same page shows runs, but a deployment has no simulators to mention."""
    drive(bag, 0.0, (1.0, 0.0), REACHED)
    bag.close()

    assert main([str(bag.path)]) == 0

    page = bag.path.with_suffix(".html").read_text()
    assert capsys.readouterr().out.strip() == str(bag.path.with_suffix(".html"))
    assert "episode 1" in page
    assert "simulator" not in page.partition("<body>")[2].partition("<script>")[0]


def test_a_damaged_record_is_refused(tmp_path, capsys):
    """A page from half of a record would mislead its reader."""
    (tmp_path / "drive.mcap").write_bytes(b"not a bag")

    assert main([str(tmp_path / "drive.mcap")]) == 2
    assert "is not a whole bag of ROS 2" in capsys.readouterr().err


def test_a_film_of_a_record_is_refused(bag, capsys, tmp_path):
    """Films are made only of runs, so the message asks for a run directory."""
    bag.close()

    assert main([str(bag.path), "--film", str(tmp_path / "film.gif")]) == 2
    assert "give one run directory" in capsys.readouterr().err
