"""A scene and its states as data: a reader returns what was written, and rejects unbounded messages."""

import contextlib
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol import scene as protocol
from palaestra_protocol.fields import ProtocolError
from palaestra_protocol.scene import (
    SceneState,
    ShapeKind,
    TargetMarker,
    Triangles,
    VisibleNode,
    VisibleScene,
    VisualShape,
)

BOX = VisualShape(kind=ShapeKind.BOX, size=(0.1, 0.2, 0.3), color=(1.0, 0.5, 0.0, 1.0))
FLOOR = VisibleNode(name="world", shapes=(VisualShape(kind=ShapeKind.PLANE, size=(4.0, 4.0, 0.0)),))
ROBOT = VisibleNode(name="robot", moves=True, robot=True, shapes=(BOX,))
WEDGE = Triangles(
    points=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), triangles=((0, 1, 2),)
)
ARENA = VisibleScene(world="arena.wbt", revision=3, nodes=(FLOOR, ROBOT), meshes=(WEDGE,))
DRIVEN = SceneState(
    time_s=1.5,
    revision=3,
    poses={"robot": (1.0, -2.0, 0.1, 0.70711, 0.0, 0.0, 0.70711)},
    joints={"wheel0": 3.25},
    target=TargetMarker(position=(1.0, 1.0, 0.0), radius_m=0.3),
    episode=7,
    step=12,
    rewards={"progress": 0.02},
)
anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=4),
)


def through_json(message):
    """Return a message after it was written as JSON and parsed."""
    return type(message).from_json(json.loads(json.dumps(message.to_json(), allow_nan=False)))


@pytest.mark.parametrize("message", [ARENA, DRIVEN, SceneState(time_s=0.0)], ids=["scene", "state", "bare"])
def test_what_is_written_is_read_back(message) -> None:
    """A viewer must show what the simulator sent, up to a hundredth of a millimeter."""
    assert through_json(message) == message


@pytest.mark.parametrize("message", [ARENA, DRIVEN], ids=["scene", "state"])
@given(data=st.data())
def test_a_wrong_part_breaks_no_reader(message, data) -> None:
    """A pod may send any JSON; a reader must raise no other error than `ProtocolError`."""
    content = message.to_json()
    name = data.draw(st.sampled_from(sorted(content)))
    content[name] = data.draw(anything)

    with contextlib.suppress(ProtocolError):
        json.dumps(type(message).from_json(content).to_json(), allow_nan=False)


@given(content=anything)
def test_no_json_at_all_breaks_a_reader(content) -> None:
    """Any program may be the sender of this JSON."""
    for kind in (VisibleScene, SceneState):
        with contextlib.suppress(ProtocolError):
            kind.from_json(content)


def test_a_number_that_is_not_finite_is_written_as_none() -> None:
    """JSON has no NaN, and one broken joint must not hide the others."""
    sick = SceneState(time_s=0.0, joints={"bad": math.nan, "good": 1.0}, rewards={"bad": math.inf})

    assert through_json(sick).joints == {"good": 1.0}
    assert through_json(sick).rewards == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"nodes": [FLOOR.to_json()] * 2}, "body.nodes: two nodes have the same name"),
        ({"meshes": [{"points": [0.0], "triangles": []}]}, "meshes[0]: the number of coordinates or corners"),
        (
            {"meshes": [{"points": [0.0] * 3, "triangles": [0, 0, 1]}]},
            "meshes[0].triangles: refers to a point",
        ),
        ({"sky": [0.0, 0.0, 2.0]}, "sky: is not 3 numbers from 0 to 1"),
        (
            {"nodes": [FLOOR.to_json() | {"shapes": [BOX.to_json() | {"kind": "mesh", "mesh": 1}]}]},
            "body.nodes: a shape refers to a mesh",
        ),
        ({"nodes": [ROBOT.to_json() | {"pose": [0.0]}]}, "nodes[0].pose: is not 7 numbers"),
    ],
)
def test_a_refusal_names_the_field_and_the_fact(changes, message) -> None:
    """The person who reads the error wrote the sender, and does not know this reader."""
    with pytest.raises(ProtocolError) as refusal:
        VisibleScene.from_json(ARENA.to_json() | changes)

    assert str(refusal.value).startswith(message)


def test_too_much_is_refused() -> None:
    """A foreign pod must not use up the memory of a viewer."""
    state = DRIVEN.to_json() | {"rewards": {f"term {i}": 0.0 for i in range(protocol.MOST_TERMS + 1)}}
    with pytest.raises(ProtocolError, match="rewards: has more than"):
        SceneState.from_json(state)

    long = {"points": [0.0] * 3 * (protocol.MOST_POINTS // 2 + 1), "triangles": []}
    with pytest.raises(ProtocolError, match="more than"):
        VisibleScene.from_json(ARENA.to_json() | {"meshes": [long, long]})
