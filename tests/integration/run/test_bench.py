"""Every part of `make bench`, and some parts of `make soak`, at the smallest scale.

The figures have no meaning at this scale. These tests run the code of the parts, because nobody runs the full
measurements for months. The parts `recovery`, `shutdown` and `memory` are tested in test_run_unattended.py,
and `operator` in test_operator_scale.py.
"""

import json
import subprocess
import sys

import pytest

from tests.bench import foreign_operators, hostile, operators
from tests.bench.__main__ import PARTS
from tests.control_plane.programs import NoPrograms
from tests.local_run import ROOT
from tests.soak import chaos
from tools.peers.operators import CHAPTER as OPERATORS
from tools.peers.page import MEASURED, chapters

SMALL = (
    "batch",
    "clients",
    "collection",
    "floor",
    "newcomer",
    "parallel",
    "planning",
    "simulators",
    "stepping",
    "watched",
    "webots",
)
OF_PEERS = ("goodput", "recoveries", "startup")
OF_A_CLUSTER = ("hostile", "operators", "operators_many")
# These parts run the examples in MEASURED of test_run_from_file_to_policy.py.
OF_WHOLE_RUNS = ("learning", "navigating", "plain", "plain_old", "seeing", "sparse", "transfer")
ELSEWHERE = ("memory", "operator", "recovery", "shutdown")
SKIPPED = "rllib"  # RLlib is not installed with this project
OF_PAGE = {chapter.part for chapter in MEASURED}  # the parts whose figures docs/explain/peers.md shows
DEADLINE_S = 800  # the work takes a minute or two on an idle machine


def numbers(found):
    """Yield all values in the results of a part, including nested ones."""
    for value in found.values():
        yield from numbers(value) if isinstance(value, dict) else [value]


def test_every_part_is_run_by_a_test():
    """A new part without a test could break unnoticed."""
    assert PARTS.keys() == {*SMALL, *OF_A_CLUSTER, *OF_WHOLE_RUNS, *OF_PEERS, *ELSEWHERE, SKIPPED}


@pytest.mark.minutes(1)
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    "parts", [SMALL, OF_WHOLE_RUNS, OF_PEERS], ids=["small", "of whole runs", "of peers"]
)
def test_the_benchmark_measures(parts, tmp_path):
    """Each part must print one line of JSON that contains only numbers, and record it for a page."""
    record = tmp_path / "figures.json"
    command = [sys.executable, "-m", "tests.bench", "--scale", "0", "--record", record, *parts]
    with (tmp_path / "errors").open("w+") as errors:
        done = subprocess.run(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=errors, timeout=DEADLINE_S, check=False
        )
        errors.seek(0)
        assert done.returncode == 0, errors.read()[-3000:]

    lines = {line.pop("part"): line for line in map(json.loads, done.stdout.splitlines())}
    assert lines.keys() == {*parts}
    for line in lines.values():
        found = list(numbers(line))
        assert len(found) > len(("scale", "seconds"))
        assert all(isinstance(number, int | float) for number in found)
    recorded = json.loads(record.read_text())
    assert {part: found["figures"].keys() for part, found in recorded.items()} == {
        part: line.keys() - {"scale"} for part, line in lines.items()
    }
    assert chapters(recorded).count("| Palaestra / the other |") == len(OF_PAGE & recorded.keys())


def test_rllib_is_skipped_in_one_line_without_an_interpreter_that_has_it():
    """Most people measure without RLlib, and must see that its figures are missing, and how to get them."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench", SKIPPED],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )

    assert done.returncode == 0
    assert done.stdout == ""
    [line] = done.stderr.splitlines()
    assert line.startswith("rllib: skipped")
    assert "--rllib" in line


@pytest.mark.minutes(1)
@pytest.mark.timeout(900)
def test_the_costly_worlds_of_one_tenant_beside_jobs_of_another_are_measured():
    """The test runs one job of each tenant on a separate control plane.

    The operator has the permissions of an installation.
    """
    found = hostile.measure(0.0)

    assert found["hostile_jobs"] == 1
    assert found["rss_mib_at_most"] >= found["rss_mib_before"] > 0
    assert all(isinstance(number, int | float) for number in numbers(found))


@pytest.mark.minutes(1)
@pytest.mark.timeout(900)
def test_one_job_of_each_operator_is_measured():
    """The part compares with operators of other projects, whose programs only `make bench` builds."""
    try:
        foreign_operators.programs(build=False)
    except NoPrograms as missing:
        pytest.skip(str(missing))

    found = operators.measure(0.0)
    many = operators.measure_many(0.0)

    assert found["jobs"] == many["jobs"] == 1
    assert many.keys() - {"jobs"} == found["training_jobs"].keys()
    assert all(figure(found) >= 0 for row in OPERATORS.rows(found) for figure in (row.ours, row.theirs))
    assert found["train_jobs"]["programs"]["kubeflow-trainer"]["writes_a_job"] > 0
    assert all(isinstance(number, int | float) for number in numbers(found))


@pytest.mark.minutes(1)
@pytest.mark.timeout(900)
def test_the_soak_of_a_training_amid_chaos_comes_to_its_figures():
    """The part runs the example chaos, here with only 1,000 steps."""
    found = chaos.measure(0.0)

    assert found["summary"]["steps"] >= chaos.LEAST_STEPS
    assert found["faults"].keys() <= {"dead", "hung", "wrong_data"}
