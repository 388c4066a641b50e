"""The recorded plans: two are whole, and every other plan is a difference from one of these two.

- `minimal.<layout>.yaml`: the whole plan of manifests/examples/minimal.yaml, in a cluster and on a laptop
- `examples/<example>.diff`: the difference of each other example from minimal.yaml with the example's name;
  hunks that are equal in both layouts come first
- `cases/<case>.plan.diff`: each `cases/<case>.job.yaml`, merged into minimal.yaml, in a cluster

In a difference, a world is one line with a checksum. The name of a ConfigMap has no hash, because the
difference contains the data.
"""

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import reduce
from operator import and_
from pathlib import Path
from typing import Any

from palaestra.api import TrainingJob, load
from palaestra.api.simulators import Builtin
from palaestra.api.yaml_io import read, write
from palaestra.errors import TrainingJobError
from palaestra.objects import Object
from palaestra.plan import ClusterLayout, Images, Layout, LocalLayout, identified, plan
from palaestra.plan.training import FILE
from palaestra.plan.yaml_text import as_yaml
from palaestra_sim.errors import WorldError
from palaestra_sim.world import builtin
from tests.golden.difference import difference

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "manifests" / "examples"
CASES = HERE / "cases"
JOB = ".job.yaml"
SMALLEST = "minimal"
LAYOUTS = ("cluster", "local")
IMAGES = Images.of_release("0.0.0")  # no release has this version, so a release changes no plan
UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"

Compared = tuple[str, str]  # the plan of the smallest job, and the plan that is compared to it


def recorded() -> Iterator[tuple[Path, str]]:
    """Yield the file and the text of each recorded plan."""
    smallest = example(SMALLEST)
    for layout in LAYOUTS:
        yield HERE / f"{SMALLEST}.{layout}.yaml", text_of(smallest, layout)
    for name in examples():
        yield HERE / "examples" / f"{name}.diff", compared(f"{name}.yaml", plans_of(name))
    before = comparable(smallest, "cluster")
    for path in cases():
        try:
            now = comparable(case(path), "cluster")
        except (TrainingJobError, WorldError) as error:
            error.add_note(f"in {path}")
            raise
        yield plan_of(path), compared(path.name, {"cluster": (before, now)})


def on_disk() -> set[Path]:
    """Return the files of recorded plans, including files that no example or case writes any more."""
    return {*HERE.glob("*.yaml"), *HERE.glob("*/*.diff")}


def examples() -> list[str]:
    """Return the names of the examples whose plans are recorded as a difference."""
    return sorted(path.stem for path in EXAMPLES.glob("*.yaml") if path.stem != SMALLEST)


def example(name: str) -> TrainingJob:
    """Return the job of manifests/examples/<name>.yaml, with a uid."""
    return identified(load((EXAMPLES / f"{name}.yaml").read_text(), name), UID)


def cases() -> list[Path]:
    """Return the files with the jobs of the cases."""
    return sorted(CASES.glob(f"*{JOB}"))


def plan_of(path: Path) -> Path:
    """Return the file in which the plan of a case is recorded."""
    return path.with_name(f"{path.name.removesuffix(JOB)}.plan.diff")


def case(path: Path) -> TrainingJob:
    """Return the job of a case: the smallest job with the fields of the case's file."""
    smallest, changes = (read(file.read_text(), file.name) for file in (EXAMPLES / f"{SMALLEST}.yaml", path))
    return identified(load(write(merged(smallest, changes)), path.name), UID)


def merged(base: Any, changes: Any) -> Any:
    """Return `base` with `changes`: fields are merged, and so are items of a list with the same `name`."""
    if isinstance(base, dict) and isinstance(changes, dict):
        return {**base, **{key: merged(base.get(key), value) for key, value in changes.items()}}
    if isinstance(base, list) and isinstance(changes, list):
        items = {item["name"]: item for item in base}
        return list(merged(items, {item["name"]: item for item in changes}).values())
    return changes


def renamed(job: TrainingJob, name: str) -> TrainingJob:
    """Return the job under another name."""
    return job.model_copy(update={"metadata": job.metadata.model_copy(update={"name": name})})


def plans_of(name: str) -> dict[str, Compared]:
    """Return, by layout, the smallest job's plan under the example's name, and the example's plan."""
    before, now = renamed(example(SMALLEST), name), example(name)
    return {layout: (comparable(before, layout), comparable(now, layout)) for layout in LAYOUTS}


def compared(job: str, plans: Mapping[str, Compared]) -> str:
    """Return the differences between the plans of a job; a hunk of all layouts occurs once."""
    hunks = {layout: Counter(difference(*pair)) for layout, pair in plans.items()}
    shared = reduce(and_, hunks.values())
    parts = [(tuple(plans), shared), *(((layout,), own - shared) for layout, own in hunks.items())]
    return "".join(headed(job, layouts, part.elements()) for layouts, part in parts if part)


def headed(job: str, layouts: Iterable[str], hunks: Iterable[str]) -> str:
    """Return hunks after two lines that name the compared plans."""
    bases = ", ".join(f"{SMALLEST}.{layout}.yaml" for layout in layouts)
    return "".join((f"--- {bases}\n", f"+++ {job}\n", *hunks))


def text_of(job: TrainingJob, layout: str) -> str:
    """Return the plan of a job in a layout as YAML."""
    return as_yaml(with_worlds_named(objects_of(job, layout)))


def comparable(job: TrainingJob, layout: str) -> str:
    """Return the plan of a job, in which `HASH` replaces the hash of each ConfigMap's data."""
    text = text_of(job, layout)
    for planned in objects_of(job, layout):
        if "data" in planned:
            name = planned["metadata"]["name"]
            text = text.replace(name, f"{name.rpartition('-')[0]}-HASH")
    return text


def objects_of(job: TrainingJob, layout: str) -> Iterable[Object]:
    """Return the objects of a job in a layout."""
    return plan(job, layout_of(job, layout)).objects


def layout_of(job: TrainingJob, name: str) -> Layout:
    """Return the layout with a name, for a job."""
    if name == "cluster":
        return ClusterLayout(images=IMAGES)
    return LocalLayout(images=IMAGES, job_directory=f"/runs/{job.metadata.name}")


def with_worlds_named(objects: Iterable[Object]) -> list[Object]:
    """Return the objects with one line in place of each world, so that a person can read the plan."""
    return [
        {**planned, "data": {key: named(key, text) for key, text in planned["data"].items()}}
        if "data" in planned
        else planned
        for planned in objects
    ]


def named(key: str, text: str) -> str:
    """Return the name, length and checksum of a world; return a text that is not a world unchanged."""
    if key == FILE:
        return text
    name = next((name for name in Builtin if builtin(name) == text.encode()), "the job's own world")
    return f"{name}, {len(text):,} characters, sha256 {hashlib.sha256(text.encode()).hexdigest()}"
