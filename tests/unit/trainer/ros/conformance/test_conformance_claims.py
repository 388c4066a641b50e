"""The verdicts on the claims about the ROS interface."""

import re
from pathlib import Path

import pytest

from palaestra_trainer.ros.conformance.claims import Claims, claims, subjects, verdicts
from palaestra_trainer.ros.conformance.report import differences, markdown, summary

PAGE = Path(__file__).parents[5] / "docs/howto/conformance.md"
PATHS = ("led/get_led", "led/set_led", "skin/get_bone_name", "supervisor/field/insert_bool")
ASKED = Claims(
    robot="robot",
    world="",
    calls=[(path, path, "webots_ros/get_int", {}) for path in PATHS],
    topics={"gps/values": "geometry_msgs/PointStamped"},
    last=[],
    expected={"led/get_led": {"value": 1.0}},
    fails=frozenset(("skin/get_bone_name",)),
    step_ms=32,
)
RIGHT = {
    "led/get_led": {"value": 1.0 + 1e-9},
    "led/set_led": {"success": True},
    "skin/get_bone_name": {"failed": "no bones"},
    "supervisor/field/insert_bool": {"success": 0},
}


def problem(path, answer):
    """Return the problem of one response among right ones."""
    found = verdicts(ASKED, {**RIGHT, path: answer}, {"gps/values": {}})
    (verdict,) = [verdict for verdict in found if verdict.path == path]
    assert not any(other.problem for other in found if other is not verdict)
    return verdict.problem


def test_right_responses_keep_every_claim():
    """Two numbers that differ by rounding are equal."""
    assert differences(verdicts(ASKED, RIGHT, {"gps/values": {}})) == []


@pytest.mark.parametrize(
    ("path", "answer", "expected"),
    [
        ("led/get_led", {"value": 2.0}, "returns {'value': 2.0} instead of {'value': 1.0}"),
        ("led/get_led", {"failed": "no node serves it"}, "no node serves it"),
        ("led/set_led", {"success": False}, "returns no success"),
        ("skin/get_bone_name", {"name": "arm"}, "succeeds, but cannot have an effect: {'name': 'arm'}"),
        (
            "supervisor/field/insert_bool",
            {"success": 1},
            "inserts a second value into a field with one value",
        ),
    ],
)
def test_a_wrong_response_is_named(path, answer, expected):
    """The line has the path and the difference from its claim."""
    assert problem(path, answer).startswith(expected)


def test_a_silent_topic_is_named_and_comes_first_in_the_report():
    """The claims that hold are in the report too, so that two reports can be compared."""
    found = verdicts(ASKED, RIGHT, {})
    text = markdown(found, {"claims": "stub"})

    assert summary(found) == "4 of 5 claims hold"
    assert differences(found) == ["gps/values: no message arrived"]
    assert text.index("`gps/values`") < text.index("`led/get_led`")
    assert "- claims: stub" in text


def test_only_our_simulators_have_our_services():
    """The program must not report Webots as wrong because Webots lacks services of our own."""
    of_webots = {path for _, path, _, _ in claims("webots").calls}

    assert subjects() == ("stub", "mujoco", "webots", "training")
    assert not any(path.startswith("palaestra/") for path in of_webots)
    assert any(path.startswith("palaestra/") for _, path, _, _ in claims("stub").calls)
    assert claims("webots").fails == frozenset()


@pytest.mark.parametrize("simulator", ["stub", "mujoco", "webots"])
def test_the_page_has_the_number_of_claims(simulator):
    """A reader compares this number with the last line of the program."""
    asked = claims(simulator)
    paths = {path for name, path, *_ in (*asked.calls, *asked.last) if name == path}
    rows = re.findall(r"^\| (.+?) \| (\d+) \| (\d+|not measured.*) \|$", PAGE.read_text(), re.MULTILINE)
    counts = {int(count) for name, count, _ in rows if name.lower() == simulator}

    assert counts == {len(paths) + len(asked.topics)}
