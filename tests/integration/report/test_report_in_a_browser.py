"""The report in a real browser: light and dark, on a desktop and on a phone."""

from __future__ import annotations

from palaestra_trainer.reporting.page import page
from palaestra_trainer.reporting.run_data import Evaluated, Replay, ReportedFault, RunData
from tests.browser import browser

LONG = "a_message_without_a_single_blank_" * 6


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
            for width, scheme in ((390, "dark"), (1200, "light")):
                seen.show_as(width=width, scheme=scheme)
                seen.open(path)
                assert seen.evaluate("document.documentElement.scrollWidth") <= width, path.name
        backgrounds = [_background(seen, scheme) for scheme in ("light", "dark")]
        seen.open(one)
        before = seen.evaluate("document.querySelector('.robot').getAttribute('transform')")
        seen.evaluate("document.querySelector('.play').click()")
        moved = seen.evaluate(
            "new Promise((done, failed) => { setTimeout(failed, 20000); const look = () => {"
            "  const now = document.querySelector('.robot').getAttribute('transform');"
            f"  if (now !== {before!r} && document.querySelector('.at').value > 3) done(now);"
            "  else requestAnimationFrame(look); }; look(); })"
        )

    assert moved != before
    assert backgrounds[0] != backgrounds[1]
    assert seen.errors == []
    assert {address.partition(":")[0] for address in seen.requests} == {"file"}


def _background(seen, scheme):
    seen.show_as(width=1200, scheme=scheme)
    return seen.evaluate("getComputedStyle(document.body).backgroundColor")
