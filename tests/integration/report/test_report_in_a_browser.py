"""The report in a real browser: light and dark, on a desktop and on a phone, with and without WebGL."""

from __future__ import annotations

from palaestra_protocol.scene import ShapeKind, Triangles, VisibleNode, VisibleScene, VisualShape
from palaestra_trainer.reporting.page import page
from palaestra_trainer.reporting.run_data import Evaluated, Replay, ReportedFault, RunData, SpaceReplay
from tests.browser import DRAWING, browser

LONG = "a_message_without_a_single_blank_" * 6
HOSTILE = "</script><script>document.title = 'hacked'</script>"
RED, GRAY = (1.0, 0.0, 0.0, 1.0), (0.6, 0.6, 0.6, 1.0)
# The number and the mean column of the red pixels of the first picture, and the number of all painted pixels.
RED_PIXELS = """(() => {
  const shown = document.querySelector('canvas'), {width, height} = shown;
  const copy = Object.assign(document.createElement('canvas'), {width, height});
  const pixels = copy.getContext('2d', {willReadFrequently: true});
  pixels.drawImage(shown, 0, 0);
  const {data} = pixels.getImageData(0, 0, width, height);
  let count = 0, sum = 0, painted = 0;
  for (let n = 0; n < data.length; n += 4) {
    if (data[n + 3] > 200) painted++;
    if (data[n] > 90 && data[n + 1] < 40 && data[n + 2] < 40) { count++; sum += n / 4 % width; }
  }
  return {count, column: sum / count / width, painted: painted / width / height};
})()"""
FRAME = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


def shape(kind, *size, color=GRAY, mesh=None):
    """Return a shape at the origin of its node."""
    return VisualShape(kind=kind, size=size, color=color, mesh=mesh)


def in_space(frames):
    """Return a recording with each kind of shape, in which a red ball drives 3 m along x."""
    tetrahedron = Triangles(
        points=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.3)),
        triangles=((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)),
    )
    still = [
        shape(ShapeKind.PLANE, 4.0, 4.0, 0.0),
        shape(ShapeKind.BOX, 0.1, 4.0, 0.2),
        shape(ShapeKind.CYLINDER, 0.3, 0.3, 0.3),
        shape(ShapeKind.CAPSULE, 0.2, 0.2, 0.6, color=(0.1, 0.1, 0.9, 0.5)),
        shape(ShapeKind.MESH, 1.0, 1.0, 1.0, mesh=0),
    ]
    scene = VisibleScene(
        world=HOSTILE,
        revision=1,
        nodes=(
            VisibleNode(name=HOSTILE, shapes=tuple(still)),
            VisibleNode(name="ball", moves=True, shapes=(shape(ShapeKind.SPHERE, 0.5, 0.5, 0.5, color=RED),)),
        ),
        meshes=(tetrahedron,),
    )
    along = [3.0 * frame / (frames - 1) - 1.5 for frame in range(frames)]
    return SpaceReplay(
        scene=scene, nodes=(1,), frames=tuple(((x, -1.0, 0.3, 1.0, 0.0, 0.0, 0.0),) for x in along)
    )


def run(name):
    """Return a run with content in every section, and with long words."""
    evaluated = [
        Evaluated(
            step=step, success_rate=step / 4000, low=0.0, high=1.0, returns=(0.1, 0.4), mean_length=30.0
        )
        for step in (1000, 2000, 3000)
    ]
    poses = tuple((0.02 * step - 1, 0.5, 0.03 * step) for step in range(60))
    return RunData(
        name=name,
        ended="failed",
        end=LONG,
        figures={"success rate": "75%", "steps": "3,000 of 50,000", "time": "12 min 30 s"},
        asked={f"algorithm.hyperparameters.{LONG[:40]}": "0.1", "seed": name},
        versions={"torch": "2.6.0"},
        evaluations=tuple(evaluated),
        confirmations=(evaluated[-1],),
        curves={"train/loss": tuple((step, 1 / step) for step in range(1, 3000, 7))},
        faults=(
            ReportedFault(
                time="2026-01-01T10:00:00Z", step=1500, simulator="collect-0", kind="dead", fact=LONG
            ),
        ),
        fault_count=1,
        goodput={"learning": 60.0, "stepping": 30.0, "recovering": 3.0},
        checkpoints=(("3,000", "1.00 MB", "2026-01-01 10:00:00 UTC"),),
        replays=(
            Replay(
                title="best",
                facts="reached",
                poses=poses,
                frame_s=0.05,
                targets=((0, 0.2, 0.5),),
                low=(-2.0, -2.0),
                high=(2.0, 2.0),
                outlines=((0.0, -0.5, 0.0, 0.0, 0.2, 0.0),),
                space=in_space(30),
            ),
        ),
        replayed="the confirmation of step 3,000",
        repeat=(("Train it again:", f"palaestra run {LONG}.yaml"),),
        files={"job.yaml": f"name: {LONG}\n" * 20},
    )


def test_a_report_is_shown_without_an_error_or_a_request_and_fits_a_phone(tmp_path):
    """Only a browser can show how a page renders.

    One test makes all checks, because a browser starts slowly.
    """
    one, two = tmp_path / "one.html", tmp_path / "two.html"
    one.write_text(page([run("arena / 0")]))
    two.write_text(page([run("arena / 0"), run("arena / 1")]))

    with browser(tmp_path / "profile") as seen:
        for path in (one, two):
            for width, scheme in ((360, "dark"), (1200, "light")):
                seen.show_as(width=width, scheme=scheme)
                seen.open(path)
                assert seen.evaluate("document.documentElement.scrollWidth") <= width, path.name
        backgrounds = [_background(seen, scheme) for scheme in ("light", "dark")]
        seen.open(one)
        sentence = seen.evaluate("document.querySelector('.flat').offsetHeight")
        before = seen.evaluate("document.querySelector('.robot').getAttribute('transform')")
        seen.evaluate("document.querySelector('.play').click()")
        moved = seen.evaluate(
            "new Promise((done, failed) => { setTimeout(failed, 20000); const look = () => {"
            "  const now = document.querySelector('.robot').getAttribute('transform');"
            f"  if (now !== {before!r} && document.querySelector('.at').value > 3) done(now);"
            "  else requestAnimationFrame(look); }; look(); })"
        )

    assert moved != before
    assert sentence > 0, "the page must say why it shows no 3D"
    assert backgrounds[0] != backgrounds[1]
    assert seen.errors == []
    assert {address.partition(":")[0] for address in seen.requests} == {"file"}


def test_an_episode_is_shown_in_3d_with_webgl(tmp_path):
    """The picture itself is checked, because an error of a shader or of a matrix leaves it empty.

    The window is small, because WebGL on a processor is slow.
    """
    path = tmp_path / "one.html"
    path.write_text(page([run("arena / 0")]))

    with browser(tmp_path / "profile", DRAWING) as seen:
        seen.show_as(width=360, scheme="dark")
        seen.open(path)
        start, end = (_red_at(seen, share) for share in (0, 1))
        seen.evaluate("document.querySelector('.view').click()")
        shown = seen.evaluate(
            "[document.querySelector('canvas').offsetHeight,"
            " document.querySelector('.replay svg').getBoundingClientRect().height, document.title]"
        )

    assert start["painted"] > 0.2
    assert min(start["count"], end["count"]) > 20
    assert end["column"] - start["column"] > 0.3
    assert shown[0] == 0
    assert shown[1] > 0
    assert "hacked" not in shown[2]
    assert seen.errors == []
    assert {address.partition(":")[0] for address in seen.requests} == {"file"}


def _red_at(seen, share):
    """Return the red pixels of the picture at a share of the episode's time."""
    seen.evaluate(
        "document.querySelectorAll('.at').forEach(one => {"
        f"  one.value = one.max * {share}; one.dispatchEvent(new Event('input')); }})"
    )
    seen.evaluate(FRAME)
    return seen.evaluate(RED_PIXELS)


def _background(seen, scheme):
    seen.show_as(width=1200, scheme=scheme)
    return seen.evaluate("getComputedStyle(document.body).backgroundColor")
