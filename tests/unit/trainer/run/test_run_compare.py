"""The comparison of two runs' policies on the same fresh episodes."""

from __future__ import annotations

import itertools
import json

import pytest

from palaestra_trainer.cli.compare import compare as compare_program
from palaestra_trainer.episodes.paired_difference import Pairs, Verdict
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import dump
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.compare import (
    Comparison,
    Rules,
    as_json,
    compare,
    contestants,
    line_of,
    notes,
    sentence_of,
)
from palaestra_trainer.run.signals import Interrupted

RULES = Rules()
SHORT = {"steps": 300, "evaluation": {"everySteps": 0}}


@pytest.fixture
def reaching(play, job, directory):
    """Return the run directory of a policy that walks to the goal."""
    play(job("REINFORCE", **SHORT))
    return directory.path


@pytest.fixture
def staying(play, job, tmp_path):
    """Return the run directory of a policy that stays away from the goal, because each step was rewarded."""
    directory = RunDirectory(tmp_path / "staying")
    play(job("REINFORCE", **SHORT), step_reward=1.0, into=directory)
    return directory.path


@pytest.fixture
def written(make_configuration, tmp_path):
    """Return a function that writes a run directory with a configuration and an empty model."""

    def write(name, **fields):
        run = tmp_path / name
        run.mkdir()
        (run / "training.yaml").write_text(dump(make_configuration(**fields)))
        (run / "model.zip").touch()
        return run

    return write


@pytest.fixture
def compared(make_member):
    """Return a function that compares two runs; it returns the result, the reports and the simulators."""

    def run(a, b, rules=RULES, **options):
        members, reports = options.get("members", []), []

        def make_members(configuration):
            made = [make_member(entry.name) for entry in configuration.simulators]
            for member in made:
                member.env.report = options.get("report", member.env.report)
            members.extend(made)
            return made

        check = {"check": options["check"]} if "check" in options else {}
        return compare(a, b, lambda _: make_members, rules, reports.append, **check), reports, members

    return run


def test_the_better_policy_is_known_after_one_batch_of_fresh_episodes(reaching, staying, compared):
    """One policy always succeeds and the other never.

    Both play the same seeds. No run uses these, since a policy may have been trained or chosen on a run's
    seeds.
    """
    result, reports, (ours, theirs) = compared(reaching, staying)

    assert result == Comparison(pairs=Pairs(only_a=20), verdict=Verdict.A_BETTER, faults=0, ended=True)
    assert reports == [result]
    assert (ours.log[-1], theirs.log[-1]) == ("stop", "stop")
    assert ours.env.seeds == theirs.env.seeds
    assert len(set(ours.env.seeds)) == 20
    assert min(ours.env.seeds) >= 2**31


def test_a_policy_is_like_itself_as_soon_as_the_bounds_allow(reaching, compared):
    """Playing all the other episodes would be a waste of time."""
    result, reports, _ = compared(reaching, reaching)

    assert (result.verdict, result.pairs) == (Verdict.ALIKE, Pairs(both=100))
    assert [report.ended for report in reports] == [False, False, False, False, True]


def test_a_comparison_ends_undecided_after_its_episodes(reaching, compared):
    """The last batch has the number of episodes that are left."""
    result, reports, _ = compared(reaching, reaching, Rules(episodes=30))

    assert (result.verdict, result.ended) == (Verdict.UNDECIDED, True)
    assert [report.pairs.episodes for report in reports] == [20, 30]


def test_an_interrupted_comparison_stops_its_simulators(reaching, compared):
    """After Ctrl-C, no simulator must keep running."""
    looks = itertools.count()
    members = []

    def check():
        if next(looks) > 20:
            raise Interrupted("SIGTERM received")

    with pytest.raises(Interrupted):
        compared(reaching, reaching, Rules(episodes=10**6, margin=1e-6), check=check, members=members)

    assert [member.log[-1] for member in members] == ["stop", "stop"]


def test_without_reports_of_success_no_policy_is_better(reaching, compared):
    """Returns have no bounds, so no number of episodes could decide."""
    with pytest.raises(ConfigurationError, match=r'reports no success.*set info\["is_success"\]'):
        compared(reaching, reaching, report=lambda _seed, _reached: {})


def test_policies_of_different_tasks_are_refused_before_anything_starts(written):
    """Success would not mean the same in both tasks. The error lists all differences at once."""
    a, b = written("a"), written("b", environment={"id": "Other-v0"}, robot="EPuck")

    with pytest.raises(ConfigurationError) as refused:
        contestants(a, b)

    first, second = str(refused.value).splitlines()
    assert first == (
        "environment.id: A learned Corridor-v0, but B learned Other-v0; compare policies of one environment"
    )
    assert second == "robot: A drives Robotino, but B drives EPuck; compare policies of one robot"


def test_a_run_without_a_policy_is_named(written):
    """Of two paths, a person must see which one is wrong."""
    a, empty = written("a"), written("empty")
    (empty / "model.zip").unlink()

    with pytest.raises(ConfigurationError, match=r"empty/model\.zip: does not exist; train first"):
        contestants(a, empty)


def test_both_simulators_are_those_of_a_with_names_of_their_own(written):
    """With equal ROS names, each simulator would unregister the other one from the master."""
    first, second = contestants(written("a", uid="1"), written("b", uid="2"), "mujoco")

    (ours,), (theirs,) = first.simulators, second.simulators
    assert (ours.driver, theirs.driver) == ("mujoco", "mujoco")
    assert ours.world == theirs.world
    assert ours.index != theirs.index
    assert ours.name != theirs.name
    assert second.uid == first.uid


def test_options_that_differ_are_told(written):
    """A person may want to compare just these options, so they are printed and not rejected."""
    other = written("b", environment={"id": "Corridor-v0", "options": {"max_steps": 5}})

    assert list(notes(written("a"), other)) == [
        "environment.options differ (max_steps): each policy plays with the options of its own job"
    ]


@pytest.mark.parametrize(
    ("pairs", "verdict", "sentence"),
    [
        (
            Pairs(only_a=20),
            "a",
            "A is better: its success rate is 55.2 to 100 points higher, after 20 episodes",
        ),
        (
            Pairs(only_b=20),
            "b",
            "B is better: its success rate is 55.2 to 100 points higher, after 20 episodes",
        ),
        (Pairs(both=100), "alike", "no difference larger than 5 points, after 100 episodes"),
        (
            Pairs(both=10),
            "undecided",
            "undecided after 10 episodes: A - B is -35.5 to 35.5 points; a larger --episodes continues",
        ),
    ],
)
def test_each_verdict_is_a_sentence(pairs, verdict, sentence):
    """Many people read only this line."""
    comparison = Comparison(pairs=pairs, verdict=Verdict(verdict), faults=0, ended=True)

    assert sentence_of(comparison, Rules()) == sentence


def test_a_batch_is_a_line_and_the_end_an_object():
    """A person reads the line and a program the object, so both have the same interval."""
    pairs = Pairs(both=14, only_a=4, only_b=1, neither=1)
    comparison = Comparison(pairs=pairs, verdict=Verdict.UNDECIDED, faults=2, ended=True)

    told = as_json(comparison, Rules())

    assert line_of(comparison) == "    20 episodes · A 90% · B 75% · A - B 15 points (-20.4 to 50.3)"
    assert told["success_rate"] == [0.9, 0.75]
    assert told["difference_interval"] == [-0.2042, 0.5027]
    assert (told["verdict"], told["faults"], told["only_a"], told["only_b"]) == ("undecided", 2, 4, 1)


@pytest.fixture
def program(make_member, monkeypatch):
    """Return `palaestra-compare`, which plays in simulators of this process."""

    def connect_here(configuration, run):
        del run
        return [make_member(entry.name) for entry in configuration.simulators]

    monkeypatch.setattr("palaestra_trainer.simulators.connect.connect_here", connect_here)
    return lambda *arguments: compare_program([*map(str, arguments)])


def test_a_person_gets_a_line_for_each_batch_and_a_sentence(reaching, staying, program, capsys):
    """The first lines name both runs, because the others only call them A and B."""
    code = program(reaching, staying, "--margin", "0.1")

    first, second, *others, line, sentence = capsys.readouterr().out.splitlines()
    assert code == 0
    assert (first, second) == (f"A: {reaching}", f"B: {staying}")
    assert not [each for each in others if "A is better" in each]
    assert line.startswith("    20 episodes · A 100% · B 0% · A - B 100 points")
    assert sentence.startswith("A is better: its success rate is ")


def test_a_program_gets_one_object_and_no_other_line(reaching, program, capsys):
    """A program could not parse an object between lines of text, and needs the exit code."""
    code = program(reaching, reaching, "--json", "--episodes", "30")

    told = json.loads(capsys.readouterr().out)
    assert code == 3
    assert (told["a"], told["b"]) == (str(reaching), str(reaching))
    assert (told["verdict"], told["episodes"]) == ("undecided", 30)
