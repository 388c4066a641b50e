"""A process with a budget checks costly worlds, so that other tenants do not wait."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from palaestra.cluster import Api
from palaestra.operator.world_check_process import WorldCheckProcess
from palaestra.plan import GivenWorld, WorldVerdict
from tests.bench.hostile import costly, with_world
from tests.integration.operator.cluster import Place
from tests.integration.operator.conftest import Start
from tests.waiting import eventually

FIELD = "spec.simulators[0].world.inline"
FINE = GivenWorld(field=FIELD, source=costly(20_000))
REMEDY = "make the world smaller, or put it into the image and name it with world.file"
PARENT = """
import sys
from palaestra.operator.world_check_process import WorldCheckProcess
from palaestra.plan import GivenWorld
from tests.bench.hostile import costly
WorldCheckProcess(mebibytes=4096).check([GivenWorld(field="f", source=costly(30_000_000))])
"""


def given(size: int) -> GivenWorld:
    """Return a world of this size whose check is costly."""
    return GivenWorld(field=FIELD, source=costly(size))


def test_a_process_returns_the_verdicts_on_several_worlds() -> None:
    """A separate process must give the same verdicts as a check in the operator itself."""
    wrong = GivenWorld(field=FIELD, source=b"#VRML_SIM R2023b utf8\n}")

    found = WorldCheckProcess().check([FINE, wrong])

    assert found[FINE.digest] == WorldVerdict()
    assert found[wrong.digest].problem.startswith(f"{FIELD}:2:1: found }} where the type of a node should be")


@pytest.mark.parametrize(
    ("budget", "size", "words"),
    [
        pytest.param({"mebibytes": 64}, 900_000, "64 MiB of memory", id="memory"),
        pytest.param({"seconds": 0, "mebibytes": 1024}, 5_000_000, "0 s of processor time", id="time"),
    ],
)
def test_a_world_over_its_budget_is_refused(budget: dict[str, int], size: int, words: str) -> None:
    """The message must contain the field, the limit and the remedy for the author.

    A world that was checked earlier in the same process keeps its verdict.
    """
    large = given(size)

    found = WorldCheckProcess(**budget).check([FINE, large])

    problem = f"{FIELD}: its check needs more than {words}, the limit for one world; {REMEDY}"
    assert found == {
        FINE.digest: WorldVerdict(),
        large.digest: WorldVerdict(problem=problem, too_costly=True),
    }


def test_a_deadline_is_no_verdict() -> None:
    """On a busy node, the check of any world may take too long, which is not the author's fault."""
    assert WorldCheckProcess(mebibytes=1024, deadline_s=0.01).check([given(900_000)]) == {}


def test_a_check_ends_with_the_operator(tmp_path: Path) -> None:
    """If a kubelet kills the operator, the check must not continue to use memory."""
    folder = {"PYTHONPATH": str(Path(__file__).parents[3])}
    with (tmp_path / "log").open("wb") as log:
        parent = subprocess.Popen([sys.executable, "-c", PARENT], env=os.environ | folder, stderr=log)
    children = Path(f"/proc/{parent.pid}/task")
    child = eventually(
        lambda: [each for path in children.glob("*/children") for each in path.read_text().split()]
    )

    parent.send_signal(signal.SIGKILL)
    parent.wait()

    eventually(lambda: not Path(f"/proc/{child[0]}").exists())


def test_another_tenant_does_not_wait_for_costly_worlds(installed: Api, place: Place, start: Start) -> None:
    """Only the author of the costly worlds may wait for their check.

    The operator checks these worlds one by one, and the status of their jobs shows it.
    """
    other = Place(installed, "other")
    operator = start(f"--namespace={other.name}", "--workers=1")
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda number: place.train(f"evil-{number}", **with_world(500_000, number)), range(3)))
    eventually(lambda: any(reason(place, number) == "CheckingWorlds" for number in range(3)))

    other.train("small", **with_world(5_000))
    other.train("large", **with_world(100_000))
    for name in ("small", "large"):
        eventually(lambda name=name: other.condition("Accepted", name).get("status") == "True", 60)
    waiting = [number for number in range(3) if reason(place, number) == "CheckingWorlds"]

    assert waiting != []
    assert operator.ask("/healthz")
    eventually(
        lambda: all(place.condition("Accepted", f"evil-{n}").get("status") == "True" for n in range(3)), 120
    )


def reason(place: Place, number: int) -> str:
    """Return the reason in the condition Accepted of a costly job."""
    return str(place.condition("Accepted", f"evil-{number}").get("reason", ""))
