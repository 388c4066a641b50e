"""The committed files match the models, and the documented examples are valid."""

import re
import subprocess

import pytest

from palaestra.api import API_VERSION, Driver, Role, load
from palaestra.api.crd import schema
from palaestra.api.generated_files import generated_files
from palaestra.api.reference import page, tables
from palaestra.api.simulators import Builtin
from palaestra_sim.world import builtin

EXAMPLES = [
    "cartpole-mjcf",
    "chaos",
    "curriculum",
    "imprecise",
    "minimal",
    "move-to-target",
    "move-to-target-batch",
    "move-to-target-mujoco",
    "navigate",
    "paper-dqn",
    "reinforce",
    "see-target",
    "sparse-reward",
    "standby",
    "tiny",
    "two-collectors",
]


@pytest.mark.parametrize(
    "name", ["manifests/crd.yaml", "charts/palaestra/crd.yaml", "docs/reference/trainingjob.md"]
)
def test_the_committed_file_is_current(name, repository) -> None:
    """After a change of the models, these files are outdated until `make golden` generates them again."""
    assert (repository / name).read_text(encoding="utf-8") == generated_files(repository)[name]


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_a_job_of_its_own_name(name, repository) -> None:
    """A user finds the job in a cluster by the name of the file.

    So every example is a valid job with that name.
    """
    path = repository / "manifests/examples" / f"{name}.yaml"

    job = load(path.read_text(encoding="utf-8"), path.name)

    assert job.metadata.name == name


def test_every_example_is_tested_here(repository) -> None:
    """An example that no test reads becomes outdated unnoticed."""
    found = (repository / "manifests/examples").glob("*.yaml")

    assert sorted(path.stem for path in found) == EXAMPLES


def test_the_smallest_example_is_twelve_lines_at_most(repository) -> None:
    """The README shows this job, so it must be short, and most fields need good defaults."""
    text = (repository / "manifests/examples/minimal.yaml").read_text(encoding="utf-8")

    assert len(text.splitlines()) <= 12


def test_the_examples_show_what_their_names_say(repository) -> None:
    """A user chooses an example by its name, such as two-collectors or sparse-reward."""

    def job(name: str):
        text = (repository / f"manifests/examples/{name}.yaml").read_text(encoding="utf-8")
        return load(text, name).spec

    collectors = [g.count for g in job("two-collectors").simulators if g.role is Role.COLLECT]
    assert collectors == [2]
    assert job("sparse-reward").trainer.environment.reward == "Sparse"
    assert job("reinforce").trainer.algorithm.name == "REINFORCE"
    assert (job("move-to-target").trainer.algorithm.name, job("move-to-target").trainer.steps) == (
        "DQN",
        25_000,
    )


def test_the_example_for_mujoco_is_the_same_job_with_another_driver(repository) -> None:
    """Policies of `make run SIM=mujoco` and of the stub can be compared only if their jobs are equal."""
    folder = repository / "manifests/examples"
    stub, mujoco = (
        load((folder / f"{name}.yaml").read_text(encoding="utf-8"), name).spec
        for name in ("move-to-target", "move-to-target-mujoco")
    )

    groups = tuple(group.model_copy(update={"driver": Driver.MUJOCO}) for group in stub.simulators)

    assert mujoco == stub.model_copy(update={"simulators": groups})


@pytest.mark.parametrize(
    ("chosen", "example"),
    [([], "move-to-target"), (["SIM=stub"], "move-to-target"), (["SIM=mujoco"], "move-to-target-mujoco")],
)
def test_make_run_takes_the_example_of_the_simulator(chosen, example, repository) -> None:
    """Each simulator has its own run directory, so no run is resumed in another simulator."""
    shown = subprocess.run(
        ["make", "--no-print-directory", "--dry-run", "run", *chosen],
        cwd=repository,
        capture_output=True,
        text=True,
        check=True,
    )

    assert shown.stdout.splitlines()[-1].endswith(f"palaestra run manifests/examples/{example}.yaml")


def test_the_page_shows_the_smallest_example(repository) -> None:
    """A reader can copy the example from the page and run it."""
    text = (repository / "docs/reference/trainingjob.md").read_text(encoding="utf-8")
    shown = re.search(r"```yaml\n(.*?)```", text, re.DOTALL)

    assert shown
    assert shown[1] == (repository / "manifests/examples/minimal.yaml").read_text(encoding="utf-8")


def test_the_page_quotes_the_real_messages(repository, problems) -> None:
    """A user who compares a message with the page must find the same words there."""
    text = (repository / "docs/reference/trainingjob.md").read_text(encoding="utf-8")

    (role,) = problems({"simulators.1.role": "Eval"})
    (steps,) = problems({"steps": 1})

    assert f"```text\n{role}\n{steps}\n```" in text


def test_every_field_has_a_row() -> None:
    """The tables of the reference page must contain every field."""
    text = tables()

    def names(at: dict) -> set[str]:
        below = [*at.get("properties", {}).values(), *([at["items"]] if "items" in at else [])]
        return set(at.get("properties", {})).union(*map(names, below))

    fields = schema()["properties"]
    assert {name for name in names(fields["spec"]) | names(fields["status"])
            if f"| `{name}` |" not in text} == set()  # fmt: skip


def test_every_rule_stands_below_its_table() -> None:
    """The author of a job can read each rule on the reference page before a job breaks it."""
    section = tables().split("### spec.storage\n")[1].split("###")[0]

    assert "- `resumeFrom`: needs existingClaim; name the claim that contains the run" in section


def test_a_table_tells_type_default_and_what_is_required() -> None:
    """A reader must see in the table which fields are required, and the default of each other field."""
    rows = tables().splitlines()

    assert any(row.startswith("| `count` | integer, 1 to 16 | `1` |") for row in rows)
    assert any(row.startswith("| `role` | `Collect` \\| `Evaluate` | *required* |") for row in rows)
    assert any(row.startswith("| `image` | text | absent |") for row in rows)
    assert any(row.startswith("| `stopAtSuccessRate` | number, above 0 to 1 |") for row in rows)
    assert any(row.startswith("| `startTime` | time | absent |") for row in rows)
    assert any(row.startswith("| `limits` | map to quantity |") for row in rows)


def test_only_the_marked_part_of_a_page_is_made_anew(repository) -> None:
    """People write the introduction of the page, so the generator must not change it."""
    text = (repository / "docs/reference/trainingjob.md").read_text(encoding="utf-8")

    made = page(text.replace("spec.storage", "spec.tsorage"))

    assert made == page(text)
    assert made.startswith("# The TrainingJob\n")


def test_a_page_without_marks_is_refused() -> None:
    """Without this error the page would lack its tables, and nobody would notice."""
    with pytest.raises(ValueError, match="add both"):
        page("# The TrainingJob\n")


def test_the_api_version_is_that_of_the_examples(repository) -> None:
    """A new API version must also reach the examples, which users copy."""
    text = (repository / "manifests/examples/minimal.yaml").read_text(encoding="utf-8")

    assert text.startswith(f"apiVersion: {API_VERSION}\n")


@pytest.mark.parametrize("name", list(Builtin))
def test_every_builtin_world_ships(name) -> None:
    """Every world that the API offers must be in the package."""
    assert builtin(name).startswith(b"#VRML_SIM")
