"""Read the data of a report from a run directory; omit the data of missing or damaged files."""

from __future__ import annotations

import shlex
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from palaestra_protocol.masking import masked
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.event_files import Scalars, add_scalars
from palaestra_trainer.reporting.plain_values import (
    flat,
    number,
    numbers,
    record,
    records,
    text,
    without_values_of_env,
)
from palaestra_trainer.reporting.read_replays import replays_of
from palaestra_trainer.reporting.run_data import Evaluated, Points, ReportedFault, RunData
from palaestra_trainer.reporting.tolerant_files import head, json_file, lines, yaml_file

MOST_CURVES_BYTES = 64 * 2**20  # limit for all event files together; this many bytes take 5 s to read
_INTERRUPTED = 75
_TRAINING_FIRST = ("rollout/", "reward/", "train/")


def read_run(directory: RunDirectory) -> RunData:
    """Return the data of a run's report."""
    folder = directory.path
    summary, end = json_file(directory.summary), json_file(directory.end)
    outcome = json_file(folder / "outcome.json")
    job = record(yaml_file(directory.configuration))
    evaluations = _evaluated(directory.evaluations)
    confirmations = _evaluated(directory.confirmations)
    counters = record(json_file(directory.journal).get("counters"))
    faults = _faults(directory.faults)
    ended, words = _end(summary, end, outcome)
    replays = json_file(directory.replays)
    return RunData(
        name=f"{text(job.get('job')) or folder.parent.name} / {text(job.get('replica', folder.name))}",
        ended=ended,
        end=words,
        figures=_figures(summary or end, job, counters, "" if summary else ", last evaluation"),
        asked=_asked(job, json_file(directory.hyperparameters)),
        versions={name: text(value) for name, value in _versions(directory).items()},
        evaluations=evaluations,
        confirmations=confirmations,
        curves=_curves(directory.tensorboard),
        faults=faults,
        fault_count=max(len(faults), _fault_count(summary, end, counters)),
        goodput=_seconds(summary.get("goodput") or end.get("goodput") or counters.get("goodput")),
        checkpoints=_checkpoints(directory.checkpoints),
        attempts=tuple(
            (text(line.get("started")), text(line.get("reason"))) for line in lines(directory.attempts)
        ),
        replays=tuple(replays_of(replays)),
        replayed=text(replays.get("of")),
        repeat=_repeat(folder, job),
        files=_files(folder),
    )


def _end(summary: Mapping[str, Any], end: Mapping[str, Any], outcome: Mapping[str, Any]) -> tuple[str, str]:
    """Return a key of `sections.ENDED`, and the end of the run in words."""
    if summary:
        return "good", text(end.get("reason") or "Completed: the training is complete")
    code = end.get("exit_code", outcome.get("exit_code"))
    words = text(end.get("reason") or outcome.get("reason"))
    if code is None:
        return "open", "no record of an end: the run continues, or its trainer was killed"
    if code == 0:
        return "good", words
    return ("interrupted" if code == _INTERRUPTED else "failed"), words or f"exit code {code}"


def _figures(
    known: Mapping[str, Any], job: Mapping[str, Any], counters: Mapping[str, Any], note: str
) -> dict[str, str]:
    interval = record(known.get("success_interval"))
    rate, low, high = (
        number(value) for value in (known.get("success_rate"), *map(interval.get, ("low", "high")))
    )
    steps, target = number(known.get("steps", known.get("step"))), number(job.get("steps"))
    duration = number(known.get("duration_s")) or sum(_seconds(counters.get("goodput")).values())
    shown = {
        "success rate": None if rate is None else f"{rate:.0%}{note}",
        "95 % interval": None
        if low is None or high is None
        else f"{low:.0%} to {high:.0%}, {text(interval.get('episodes'))} episodes",
        "mean return": _formatted(known.get("mean_return"), "{:.3f}"),
        "best policy at step": _formatted(known.get("best_step"), "{:,.0f}"),
        "steps": None
        if steps is None
        else f"{steps:,.0f}" + ("" if target is None else f" of {target:,.0f}"),
        "steps per second": _formatted(known.get("steps_per_second"), "{:.1f}"),
        "time": _duration(duration) if duration else None,
        "spent on training": _formatted(known.get("trained_share"), "{:.0%}"),
        "faults": _formatted(known.get("faults"), "{:,.0f}"),
        "restarts": _formatted(known.get("restarts"), "{:,.0f}"),
        "steps lost": _formatted(known.get("steps_lost"), "{:,.0f}"),
    }
    return {name: value for name, value in shown.items() if value is not None}


def _formatted(value: object, form: str) -> str | None:
    known = number(value)
    return None if known is None else form.format(known)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"


def _asked(job: Mapping[str, Any], hyperparameters: Mapping[str, Any]) -> dict[str, str]:
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for simulator in records(job.get("simulators")):
        groups.setdefault(text(simulator.get("group")), []).append(simulator)
    simulators = {
        f"simulators {name}": f"{len(group)} \u00d7 {text(group[0].get('driver')) or 'own command'}, "
        f"{text(group[0].get('role'))}, world {Path(text(group[0].get('world'))).name or 'of its own'}"
        for name, group in groups.items()
    }
    wanted = dict(flat({name: job.get(name) for name in ("environment", "seed", "steps")}))
    algorithm = {f"algorithm.{path}": value for path, value in flat(job.get("algorithm"))}
    defaults = {f"algorithm.hyperparameters.{path}": value for path, value in flat(hyperparameters)}
    others = dict(flat({name: job.get(name) for name in ("evaluation", "checkpoint", "device")}))
    return {**wanted, **simulators, **algorithm, **defaults, **others}


def _versions(directory: RunDirectory) -> Mapping[str, Any]:
    """Return the versions of the newest attempt that recorded them."""
    found: Mapping[str, Any] = {}
    for line in lines(directory.attempts):
        found = record(line.get("versions")) or found
    return found


def _evaluated(path: Path) -> tuple[Evaluated, ...]:
    found = []
    for line in lines(path):
        step, interval = number(line.get("step")), record(line.get("success_interval"))
        if step is None:
            continue
        rate = number(line.get("success_rate"))
        found.append(
            Evaluated(
                step=step,
                success_rate=None if rate is None else min(max(rate, 0.0), 1.0),
                low=number(interval.get("low")),
                high=number(interval.get("high")),
                returns=numbers([one.get("return") for one in records(line.get("played"))]),
                mean_length=number(line.get("mean_length")),
            )
        )
    return tuple(sorted(found, key=lambda one: one.step))


def _faults(path: Path) -> tuple[ReportedFault, ...]:
    """Return the faults; their downtimes are in later lines, which report that the simulator is up again."""
    found: list[ReportedFault] = []
    open_: dict[tuple[str, str], list[int]] = {}  # indices in `found`, by attempt and simulator
    for line in lines(path):
        key = text(line.get("attempt")), text(line.get("simulator"))
        if "up_after_s" in line:
            for place, seconds in zip(open_.pop(key, ()), numbers(line["up_after_s"]), strict=False):
                found[place] = replace(found[place], seconds=seconds)
        elif "kind" in line:
            open_.setdefault(key, []).append(len(found))
            found.append(_fault(line))
    return tuple(found)


def _fault(line: Mapping[str, Any]) -> ReportedFault:
    return ReportedFault(
        time=text(line.get("time")),
        step=number(line.get("step")) or 0.0,
        simulator=text(line.get("simulator")),
        kind=text(line.get("kind")),
        fact=text(line.get("fact")),
        steps_lost=number(line.get("steps_lost")) or 0.0,
    )


def _fault_count(summary: Mapping[str, Any], end: Mapping[str, Any], counters: Mapping[str, Any]) -> int:
    known = number(summary.get("faults", end.get("faults")))
    if known is not None:
        return int(known)
    kinds = record(counters.get("faults"))
    return int(sum(number(count) or 0 for kind, count in kinds.items() if kind != "slow"))


def _seconds(goodput: object) -> dict[str, float]:
    return {name: known for name, value in record(goodput).items() if (known := number(value)) is not None}


def _curves(folder: Path) -> dict[str, Points]:
    found: Scalars = {}
    left = MOST_CURVES_BYTES
    for path in sorted(folder.glob("events.out.tfevents.*"), key=_written):
        content = head(path, left)  # a file is readable only from its start
        left -= len(content)
        add_scalars(content, found)
    curves = {
        name: tuple((step, value) for step, value in sorted(points.items()) if number(value) is not None)
        for name, points in found.items()
        if not name.startswith(("eval/", "confirm/", "goodput/", "simulators/"))
    }
    return {name: curves[name] for name in sorted(curves, key=_place) if len(curves[name]) > 1}


def _place(name: str) -> tuple[int, str]:
    groups = [index for index, group in enumerate(_TRAINING_FIRST) if name.startswith(group)]
    return (groups[0] if groups else len(_TRAINING_FIRST), name)


def _written(path: Path) -> tuple[float, str]:
    """Return the time that the name of an event file contains, and the name."""
    stamp = path.name.split(".")[3:4]
    return (float(stamp[0]) if stamp and stamp[0].isdigit() else 0.0, path.name)


def _checkpoints(folder: Path) -> tuple[tuple[str, str, str], ...]:
    found = []
    with suppress(OSError):
        for place in sorted(
            (one for one in folder.iterdir() if one.name.isdigit()), key=lambda one: int(one.name)
        ):
            manifest = place / "manifest.json"
            size = sum(file.stat().st_size for file in place.rglob("*") if file.is_file())
            stamp = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(manifest.stat().st_mtime))
            found.append((f"{int(place.name):,}", f"{size / 1e6:.2f} MB", stamp))
    return tuple(found)


def _repeat(folder: Path, job: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return pairs of a sentence and the command that it describes, with the paths of the run directory."""
    train = f"palaestra run job.yaml --replica {shlex.quote(text(job.get('replica', folder.name)))}"
    if (folder / "job.yaml").exists():
        again = ("Save the job below as job.yaml, and train it again on one machine:", train)
    else:
        name, namespace = (shlex.quote(text(job.get(word))) for word in ("job", "namespace"))
        saved = f"palaestra get {name} -n {namespace} -o yaml > job.yaml"
        again = ("Save the job from its cluster, and train it again on one machine:", f"{saved}\n{train}")
    run = shlex.quote(f"{folder.parent.name}/{folder.name}")
    return (again, ("Measure its policy on 100 episodes that no training used:", f"palaestra-eval {run}"))


def _files(folder: Path) -> dict[str, str]:
    found = {}
    for name in ("job.yaml", "training.yaml"):
        content = yaml_file(folder / name)
        if content:
            found[name] = masked(
                yaml.safe_dump(without_values_of_env(content), sort_keys=False, allow_unicode=True)
            )
    return found
