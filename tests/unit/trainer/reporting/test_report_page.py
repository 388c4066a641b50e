"""A report is one page of bounded size. A person can open it safely, whatever texts the run contains."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.scene import ShapeKind, Triangles, VisibleNode, VisibleScene, VisualShape
from palaestra_trainer.reporting import page as pages
from palaestra_trainer.reporting.charts import Series, chart, ticks
from palaestra_trainer.reporting.elements import element, own_code
from palaestra_trainer.reporting.page import MOST_BYTES, page
from palaestra_trainer.reporting.run_data import Evaluated, Replay, ReportedFault, RunData, SpaceReplay

REFERENCES = re.compile(
    r"\b(src|href|srcset|action|data|poster|xlink:href)\s*=|url\(|@import|import\s*\(|fetch\("
)

texts = st.text(st.characters(), max_size=30) | st.sampled_from(
    ["</script><script>alert(1)</script>", '"><img src=https://example.com/x>', "<!--", "&amp;", "\x00\ud800"]
)
numbers = st.floats(-1e15, 1e15)
steps = st.floats(0, 1e12)
shares = st.floats(0, 1)


def in_space(scene, frames):
    """Return a replay in three dimensions, in which the first node of the scene moves."""
    poses = tuple(((0.01 * frame, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),) for frame in range(frames))
    return SpaceReplay(scene=scene, nodes=(0,), frames=poses)


@st.composite
def scenes(draw):
    """Draw a scene whose names may be any texts."""
    shape = VisualShape(kind=ShapeKind.BOX, size=(1.0, 1.0, 1.0))
    return VisibleScene(
        world=draw(texts), revision=1, nodes=(VisibleNode(name=draw(texts), shapes=(shape,)),)
    )


@st.composite
def replays(draw):
    """Draw the recording of an episode."""
    pose = st.tuples(numbers, numbers, numbers)
    corner = st.none() | st.tuples(numbers, numbers)
    return Replay(
        title=draw(texts),
        facts=draw(texts),
        poses=tuple(draw(st.lists(pose, max_size=5))),
        frame_s=draw(st.floats(1e-3, 1e3)),
        targets=tuple(draw(st.lists(st.tuples(st.integers(0, 9), numbers, numbers), max_size=2))),
        low=draw(corner),
        high=draw(corner),
        outlines=tuple(draw(st.lists(st.tuples(*[numbers] * 6), max_size=2))),
        space=draw(st.none() | scenes().map(lambda scene: in_space(scene, 2))),
        not_in_space=draw(texts),
    )


@st.composite
def runs(draw):
    """Draw a run whose texts may be anything, and whose numbers may be any that the reader accepts."""
    named = st.dictionaries(texts, texts, max_size=3)
    evaluated = st.builds(
        Evaluated,
        step=steps,
        success_rate=st.none() | shares,
        low=st.none() | shares,
        high=st.none() | shares,
        returns=st.lists(numbers, max_size=3).map(tuple),
        mean_length=st.none() | numbers,
    )
    fault = st.builds(
        ReportedFault,
        time=texts,
        step=steps,
        simulator=texts,
        kind=texts,
        fact=texts,
        seconds=st.none() | numbers,
    )
    points = st.lists(st.tuples(steps, numbers), max_size=5).map(tuple)
    return RunData(
        name=draw(texts),
        ended=draw(texts),
        end=draw(texts),
        figures=draw(named),
        asked=draw(named),
        versions=draw(named),
        evaluations=tuple(draw(st.lists(evaluated, max_size=4))),
        confirmations=tuple(draw(st.lists(evaluated, max_size=2))),
        curves=draw(st.dictionaries(texts, points, max_size=3)),
        faults=tuple(draw(st.lists(fault, max_size=3))),
        fault_count=draw(st.integers(0, 9)),
        goodput=draw(st.dictionaries(texts, st.floats(0, 1e9), max_size=3)),
        checkpoints=tuple(draw(st.lists(st.tuples(texts, texts, texts), max_size=2))),
        attempts=tuple(draw(st.lists(st.tuples(texts, texts), max_size=2))),
        replays=tuple(draw(st.lists(replays(), max_size=2))),
        replayed=draw(texts),
        repeat=tuple(draw(st.lists(st.tuples(texts, texts), max_size=2))),
        files=draw(named),
    )


class Elements(HTMLParser):
    """A parser that collects the element names and the attributes of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []
        self.attributes: list[str] = []

    def handle_starttag(self, tag, attrs):
        """Record the element and its attributes."""
        self.names.append(tag)
        self.attributes += [name for name, _ in attrs]


def elements_of(text):
    """Return the elements of a page."""
    found = Elements()
    found.feed(text)
    return found


@cache
def large_parts():
    """Return a run that has more of each part than a page shows."""
    long = "a message with characters that take more bytes escaped: <&>\"' " * 20
    evaluated = tuple(
        Evaluated(step=step, success_rate=0.5, low=0.4, high=0.6, returns=(0.1, 0.2), mean_length=30.0)
        for step in range(300)
    )
    poses = tuple((0.001 * step, 0.002 * step, 0.1) for step in range(2000))
    mesh = Triangles(points=tuple((x / 7, 0.0, 0.0) for x in range(6_000)), triangles=((0, 1, 2),) * 12_000)
    shape = VisualShape(kind=ShapeKind.MESH, size=(1.0, 1.0, 1.0), mesh=0)
    node = VisibleNode(name="robot", shapes=(shape,))
    scene = VisibleScene(world="large", revision=1, nodes=(node,), meshes=(mesh,))
    replay = Replay(title="best", facts=long, poses=poses, frame_s=0.1, space=in_space(scene, 500))
    fault = ReportedFault(time="now", step=1, simulator=long, kind="dead", fact=long, seconds=1.5)
    names = {f"{index} {long}": long for index in range(50)}
    points = tuple((step, step) for step in range(300))
    return RunData(
        name=long,
        figures=names,
        asked=names,
        evaluations=evaluated,
        confirmations=evaluated,
        curves=dict.fromkeys(names, points),
        faults=(fault,) * 400,
        fault_count=5000,
        checkpoints=((long, long, long),) * 500,
        replays=(replay,) * 5,
        files={"job.yaml": long * 10_000},
    )


def large_run(number):
    """Return a large run with a number in its name and its fields."""
    parts = large_parts()
    asked = {name: f"{number} {value}" for name, value in parts.asked.items()}
    return replace(parts, name=f"{number} {parts.name}", asked=asked)


@given(st.lists(runs(), min_size=1, max_size=2))
def test_no_text_of_a_run_becomes_an_element_or_a_reference(drawn):
    """A person opens a report from a mail, so a job's name or a fault's message must not run as code.

    The page must not load anything either: a request would report to a server that a person opened the page.
    """
    text = page(drawn)

    found = elements_of(text)
    assert not {"link", "img", "iframe", "object", "embed", "form", "base", "audio", "video"} & {*found.names}
    assert found.names.count("script") <= 2 + sum(len(run.replays) + bool(run.replays) for run in drawn)
    assert found.names.count("style") == 1
    assert not {"src", "href", "srcset", "action", "poster", "data"} & {*found.attributes}
    assert not [name for name in found.attributes if name.startswith("on")]
    text.encode()  # fails if a surrogate is left in the text


def test_style_and_script_refer_to_nothing_outside_the_page():
    """Style and script are not escaped, so the test above does not cover them."""
    text = page([RunData(name="empty")])

    assert "http:" not in text
    assert "https:" not in text
    assert not REFERENCES.search(text)
    assert "default-src 'none'" in html.unescape(text)


@pytest.mark.parametrize("number", [1, 3, 200])
def test_a_page_is_bounded_however_large_the_runs_are(number):
    """People send reports by mail, so details are left out of a page that would be too large."""
    text = page([large_run(index) for index in range(number)])

    assert len(text.encode()) <= MOST_BYTES
    assert "0 a message" in text


def test_details_are_left_out_in_the_order_of_their_size():
    """A page of many runs is read to compare them, so it keeps the comparison and leaves out run details."""
    few, many = page([large_run(1), large_run(2)]), page([large_run(index) for index in range(100)])

    assert few.count('<details class="run">') == 2
    assert "Differences" in few
    assert "Differences" in many
    assert "100 runs side by side" in many


def test_a_page_that_cannot_be_small_enough_is_refused():
    """A caller may ask for any size, so the smallest page may still be too large."""
    with pytest.raises(ValueError, match="give fewer runs"):
        page([RunData(name="one"), RunData(name="two")], most_bytes=100)


def test_only_so_many_runs_are_shown():
    """Nobody can read a table of a thousand columns."""
    text = page([RunData(name=f"run {index}") for index in range(pages.MOST_RUNS + 1)])

    assert f"The first {pages.MOST_RUNS} are shown." in text


def test_the_replays_of_a_run_share_one_scene():
    """A scene with meshes has hundreds of kilobytes, and the three episodes have the same world."""
    [replay, *_] = large_parts().replays
    whole, bare = (
        page([RunData(name="one", replays=(one,) * 3)]) for one in (replay, replace(replay, space=None))
    )

    scene = len(json.dumps(replay.space.scene.to_json(), separators=(",", ":")))
    assert whole.count("<canvas") == 3
    assert whole.count('class="scenes"') == 1
    assert scene < len(whole) - len(bare) < 1.5 * scene


def test_an_episode_that_is_not_shown_in_three_dimensions_has_the_reason():
    """Without the reason, a reader would search the page for the missing picture."""
    replay = Replay(
        title="best", facts="", poses=((0, 0, 0),), frame_s=0.2, not_in_space="the robot drove differently"
    )

    assert "Not in 3D: the robot drove differently." in page([RunData(name="one", replays=(replay,))])


def test_everything_about_a_run_is_on_its_page():
    """Only a person would notice if a part were missing from the page."""
    run = RunData(
        name="arena / 0",
        ended="failed",
        end="Diverged: a loss is NaN",
        figures={"success rate": "96%"},
        asked={"algorithm.name": "DQN"},
        versions={"torch": "2.6"},
        evaluations=(Evaluated(step=100, success_rate=0.5, low=0.3, high=0.7, returns=(1.0, 2.0)),),
        faults=(
            ReportedFault(time="noon", step=50, simulator="collect-0", kind="dead", fact="gone", seconds=0.5),
        ),
        fault_count=1,
        goodput={"learning": 30.0, "stepping": 10.0},
        checkpoints=(("100", "1.00 MB", "noon"),),
        attempts=(("noon", "new run"),),
        replays=(Replay(title="best", facts="reached", poses=((0, 0, 0), (1, 1, 1)), frame_s=0.2),),
        replayed="the confirmation of step 100",
        repeat=(("Train it again:", "palaestra run job.yaml"),),
        files={"job.yaml": "kind: TrainingJob"},
    )

    text = page([run])

    for part in (
        *("arena / 0", "failed", "a loss is NaN", "96%", "DQN", "2.6", "evaluations: 50 % at step 100"),
        *("collect-0", "gone", "0.5", "75.0%", "1.00 MB", "new run", "the confirmation of step 100"),
        *("palaestra run job.yaml", "kind: TrainingJob", '<figure class="replay">'),
    ):
        assert part in text, part


def test_text_is_escaped_where_an_element_is_made():
    """Escaping is in one function, so no other module can forget it."""
    assert element("p", "<b>", title='"') == '<p title="&quot;">&lt;b&gt;</p>'
    with pytest.raises(ValueError, match="would end it"):
        own_code("script", "'</script>'")


@given(numbers, numbers)
def test_ticks_are_few_and_inside_their_axis(first, second):
    """Too many labels on an axis would overlap."""
    low, high = sorted((first, second))

    found = ticks(low, high)

    assert 0 < len(found) <= 7 or not found
    assert all(low <= value <= high for value in found)


@pytest.mark.parametrize("ends", [(0.0, 5e-324), (1.0, 1.0), (-1e308, 1e308), (0.0, float("inf"))])
def test_an_axis_that_no_number_divides_has_one_label_at_most(ends):
    """The distance of two labels is then zero or infinite, and no loop over them would end."""
    assert len(ticks(*ends)) <= 1


def test_a_curve_of_one_point_at_step_zero_is_drawn():
    """An evaluation before the first step is the only point of a run that has just begun."""
    drawn = str(chart("success", [Series(label="a", points=((0.0, 0.5),), dots=True)], share=True))

    assert "<svg" in drawn
    assert "nan" not in drawn
