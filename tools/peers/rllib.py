"""The chapter about RLlib, whose figures are compared with those of other parts of the same file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tools.peers.rows import RESTARTS, RUN_PROFILE, Chapter, Get, Row, always, at

TEXT = (
    "RLlib's DQN trains the same task in one env runner over one stub, with the job's hyperparameters as far "
    "as it has them. `restart_failed_sub_environments` and `restart_failed_env_runners` are on, so its "
    "program does not end when the simulator is killed. Palaestra's figures are those of the chapters above."
)
COMPARED = (
    ("a whole run", ("plain", "seconds"), "run_s"),
    ("from a command to the first step", ("startup", "palaestra_s"), "start_s"),
    (
        "from a crash of the simulator to the next step: median",
        ("recoveries", "palaestra", "median"),
        "recoveries_s",
    ),
)


def chapter(recorded: Mapping[str, Mapping[str, Any]]) -> Chapter:
    """Return the chapter, with a row for each figure of Palaestra's that is recorded."""
    rows = [
        Row(what=what, ours=_fixed(recorded, ours), theirs=_theirs(name), unit="s")
        for what, ours, name in COMPARED
        if ours[0] in recorded
    ]
    return Chapter(
        part="rllib",
        title="RLlib",
        text=TEXT,
        rows=always(*rows),
        limit=(
            "RLlib's DQN is another implementation, and was not tuned for this task; both programs ran one "
            "after the other, not in turns."
        ),
        reason=f"The parts of a run are in {RUN_PROFILE}, and those of a restart in {RESTARTS}.",
    )


def _fixed(recorded: Mapping[str, Mapping[str, Any]], path: tuple[str, ...]) -> Get:
    """Return a function that returns a figure of another part."""
    part, *names = path
    return lambda _: at(*names)(recorded[part]["figures"])


def _theirs(name: str) -> Get:
    return at(name, "median") if name == "recoveries_s" else at(name)
