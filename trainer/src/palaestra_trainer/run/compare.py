"""Play the policies of two runs on the same fresh episodes until their difference is known.

Both policies play in simulators like the one that evaluates A's policy, with the same world, program and
seeds. So an episode is equally hard for both policies. Each policy plays through the environment of its own
job.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from palaestra_protocol.pod.enums import ExitCode, Role
from palaestra_trainer.episodes.evaluation import EvaluationResult, evaluate_on_all
from palaestra_trainer.episodes.paired_difference import Pairs, Verdict, interval, verdict
from palaestra_trainer.episodes.seeds import fresh_seeds
from palaestra_trainer.episodes.wilson import CONFIDENCE, wilson
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import DEFAULT_ROBOT, Configuration, load_run
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.attempt import STOPPED_S, MakeMembers
from palaestra_trainer.run.evaluate import Playing, evaluating, playing
from palaestra_trainer.run.exit import leave_after
from palaestra_trainer.simulators.drivers import in_driver
from palaestra_trainer.waiting.at_once import at_once
from palaestra_trainer.waiting.check import Check, go_on

MakeHere = Callable[[Path], MakeMembers]  # returns a function that creates the simulators of a run directory


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """The rules of a comparison of two policies.

    Attributes:
        episodes: the largest number of episodes that each policy plays.
        batch: number of episodes between two computations of the difference.
        margin: two success rates that differ by at most this number count as equal.
        stream: name of the seed stream.
        driver: the program of both simulators; None: the program of A's simulator.
    """

    episodes: int = 1000
    batch: int = 20
    margin: float = 0.05
    stream: str = "compare"
    driver: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The state of a comparison after some episodes.

    Attributes:
        pairs: counts of the results so far.
        verdict: the verdict of these results.
        faults: how often a fault truncated an episode, which was then played again.
        ended: whether the comparison is over.
    """

    pairs: Pairs
    verdict: Verdict
    faults: int
    ended: bool

    @property
    def decided(self) -> bool:
        """Whether it is clear which policy is better, or that they are alike."""
        return self.verdict is not Verdict.UNDECIDED


def contestants(a: Path, b: Path, driver: str | None = None) -> tuple[Configuration, Configuration]:
    """Return the configurations with which A and B play, each with one simulator like A's.

    Raises:
        ConfigurationError: a run directory has no model, or the policies have different tasks; the message
            has one line for each reason.
    """
    configurations = tuple(load_run(run) for run in (a, b))
    mistakes = [
        f"{RunDirectory(run).model}: does not exist; train first, or give another run directory"
        for run in (a, b)
        if not RunDirectory(run).model.exists()
    ]
    if mistakes := mistakes + list(_differences(*configurations)):
        raise ConfigurationError("\n".join(mistakes))
    first, second = configurations
    entry = evaluating(first)[0].model_copy(update={"min_simulators": None, "standby": False})
    entry = entry if driver is None else in_driver(entry, driver)
    # The ROS name of a simulator follows from its name and index. So the second simulator gets another name
    # and index.
    other = entry.model_copy(update={"name": f"{entry.name}-b", "index": entry.index + 1})
    names = {field: getattr(first, field) for field in ("job", "namespace", "uid", "replica")}
    return (
        first.model_copy(update={"simulators": (entry,)}),
        second.model_copy(update={**names, "simulators": (other,)}),
    )


def _differences(a: Configuration, b: Configuration) -> Iterator[str]:
    """Yield the reasons why the success rates of two policies cannot be compared."""
    if a.environment.id != b.environment.id:
        yield (
            f"environment.id: A learned {a.environment.id}, but B learned {b.environment.id}; "
            "compare policies of one environment"
        )
    robots = [configuration.robot or DEFAULT_ROBOT for configuration in (a, b)]
    if robots[0] != robots[1]:
        yield f"robot: A drives {robots[0]}, but B drives {robots[1]}; compare policies of one robot"


def notes(a: Path, b: Path) -> Iterator[str]:
    """Yield the differences between two jobs that may make an episode harder for one of the policies."""
    first, second = (load_run(run) for run in (a, b))
    ours, theirs = first.environment.options, second.environment.options
    names = [name for name in sorted({*ours, *theirs}) if ours.get(name) != theirs.get(name)]
    if names:
        yield (
            f"environment.options differ ({', '.join(names)}): each policy plays with the options of its "
            "own job"
        )
    if not first.with_role(Role.EVALUATE):
        yield (
            "no simulator of A has role Evaluate: both policies play in the world of "
            f"{evaluating(first)[0].name}"
        )
    worlds = [Path(evaluating(each)[0].world).name for each in (first, second)]
    if worlds[0] != worlds[1]:
        yield f"B was evaluated in the world {worlds[1]}; both policies play in A's world, {worlds[0]}"


def compare(
    a: Path,
    b: Path,
    make_here: MakeHere,
    rules: Rules,
    report: Callable[[Comparison], object],
    check: Check = go_on,
) -> Comparison:
    """Compare the policies of two run directories until the verdict is clear or all episodes are played.

    Args:
        a: the run directory of A; both policies play in simulators like the one of this run.
        b: the run directory of B.
        make_here: a function of a run directory; the result is a function that creates the simulators.
        rules: the rules of the comparison.
        report: called after each batch; the last call comes before the simulators are stopped, because the
            stop may take a minute.
        check: called often; it raises to cancel the comparison.

    Raises:
        ConfigurationError: a run directory is wrong, the policies have different tasks, or no episode
            reports its success.
        FaultBudgetSpent: a simulator failed more often than its restart budget allows.
    """
    first, second = contestants(a, b, rules.driver)
    members = make_here(a)
    with (
        ExitStack() as last,
        playing(first, RunDirectory(a).model, members, check) as ours,
        playing(second, RunDirectory(b).model, members, check) as theirs,
    ):
        comparison = Comparison(pairs=Pairs(), verdict=Verdict.UNDECIDED, faults=0, ended=False)
        results: list[tuple[bool, bool]] = []
        while not comparison.ended:
            count = min(rules.batch, rules.episodes - len(results))
            seeds = tuple(fresh_seeds(rules.stream, count, len(results)))
            played = at_once([partial(_play, who, seeds) for who in (ours, theirs)], check, "compare")
            results += _successes(played, first.environment.id)
            comparison = _comparison(results, comparison.faults + sum(each.faults for each in played), rules)
            report(comparison)
        last.callback(leave_after(STOPPED_S, ExitCode.DONE).cancel)
    return comparison


def _play(player: Playing, seeds: tuple[int, ...], check: Check) -> EvaluationResult:
    return evaluate_on_all(player.policy, player.restarters, seeds, check)


def _successes(played: list[EvaluationResult], environment: str) -> Iterator[tuple[bool, bool]]:
    """Yield the results of A and B in each episode; an episode without a report counts as failed.

    Raises:
        ConfigurationError: no episode reports its success.
    """
    ours, theirs = ([episode.success for episode in each.episodes] for each in played)
    if all(success is None for success in (*ours, *theirs)):
        raise ConfigurationError(
            f"environment.id: {environment} reports no success, so no policy is better; "
            'set info["is_success"] in the last step of each episode'
        )
    return zip(map(bool, ours), map(bool, theirs), strict=True)


def _comparison(results: list[tuple[bool, bool]], faults: int, rules: Rules) -> Comparison:
    pairs = Pairs.of(results)
    found = verdict(pairs, rules.margin)
    ended = found is not Verdict.UNDECIDED or pairs.episodes >= rules.episodes
    return Comparison(pairs=pairs, verdict=found, faults=faults, ended=ended)


def as_json(comparison: Comparison, rules: Rules) -> dict[str, Any]:
    """Return a comparison as JSON data."""
    pairs = comparison.pairs
    rates = [successes / pairs.episodes for successes in pairs.successes]
    return {
        "verdict": comparison.verdict.value,
        "episodes": pairs.episodes,
        "success_rate": [round(rate, 4) for rate in rates],
        "success_interval": [wilson(successes, pairs.episodes).to_json() for successes in pairs.successes],
        "difference": round(pairs.difference, 4),
        "difference_interval": [round(bound, 4) for bound in interval(pairs)],
        "confidence": CONFIDENCE,
        "margin": rules.margin,
        "only_a": pairs.only_a,
        "only_b": pairs.only_b,
        "seeds": rules.stream,
        "faults": comparison.faults,
    }


def line_of(comparison: Comparison) -> str:
    """Return the comparison so far as a line of text."""
    pairs = comparison.pairs
    ours, theirs = (successes / pairs.episodes for successes in pairs.successes)
    low, high = interval(pairs)
    return (
        f"{pairs.episodes:>6,} episodes · A {ours:.0%} · B {theirs:.0%} · "
        f"A - B {_points(pairs.difference)} points ({_points(low)} to {_points(high)})"
    )


def sentence_of(comparison: Comparison, rules: Rules) -> str:
    """Return the result of the comparison as a sentence."""
    pairs, (low, high) = comparison.pairs, interval(comparison.pairs)
    after = f"after {pairs.episodes:,} episodes"
    bounds = f"{_points(low)} to {_points(high)} points"
    match comparison.verdict:
        case Verdict.A_BETTER:
            return f"A is better: its success rate is {bounds} higher, {after}"
        case Verdict.B_BETTER:
            bounds = f"{_points(-high)} to {_points(-low)} points"
            return f"B is better: its success rate is {bounds} higher, {after}"
        case Verdict.ALIKE:
            return f"no difference larger than {_points(rules.margin)} points, {after}"
        case Verdict.UNDECIDED:
            return f"undecided {after}: A - B is {bounds}; a larger --episodes continues"


def _points(share: float) -> str:
    return f"{100 * share:.1f}".removesuffix(".0")
