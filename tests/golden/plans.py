"""The plans that are recorded: two whole, and every other one as its difference from one of them.

- `minimal.<layout>.yaml`: the whole plan of manifests/examples/minimal.yaml, in a cluster and on a laptop
- `examples/<example>.diff`: each other example, compared with minimal.yaml under the example's name; first
  the hunks that are the same in both layouts, then those of one layout
- `cases/<case>.plan.diff`: each `cases/<case>.job.yaml`, merged into minimal.yaml, in a cluster

In a difference, a world is one line with its checksum, and the name of a ConfigMap is without the hash of its
data, because the data are there.
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
IMAGES = Images.of_release("0.0.0")  # not the version of any release, so that a release changes no plan
UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"

Compared = tuple[str, str]  # the plan of the smallest job, and the plan that is compared with it


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
    """Return the files of recorded plans, also of those that nothing makes any more."""
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
    """Return the file with the plan of a case."""
    return path.with_name(f"{path.name.removesuffix(JOB)}.plan.diff")


def case(path: Path) -> TrainingJob:
    """Return the smallest job with the fields of a case."""
    smallest, changes = (read(file.read_text(), file.name) for file in (EXAMPLES / f"{SMALLEST}.yaml", path))
    return identified(load(write(merged(smallest, changes)), path.name), UID)


def merged(base: Any, changes: Any) -> Any:
    """Return `base` with `changes`; fields are merged, and items of a list that have the same `name`."""
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
    """Return by layout the plan of the smallest job under the name of an example, and that of the example."""
    before, now = renamed(example(SMALLEST), name), example(name)
    return {layout: (comparable(before, layout), comparable(now, layout)) for layout in LAYOUTS}


def compared(job: str, plans: Mapping[str, Compared]) -> str:
    """Return the differences of the plans of a job; hunks that all layouts have are there once."""
    hunks = {layout: Counter(difference(*pair)) for layout, pair in plans.items()}
    shared = reduce(and_, hunks.values())
    parts = [(tuple(plans), shared), *(((layout,), own - shared) for layout, own in hunks.items())]
    return "".join(headed(job, layouts, part.elements()) for layouts, part in parts if part)


def headed(job: str, layouts: Iterable[str], hunks: Iterable[str]) -> str:
    """Return hunks below two lines that name the plans which they compare."""
    bases = ", ".join(f"{SMALLEST}.{layout}.yaml" for layout in layouts)
    return "".join((f"--- {bases}\n", f"+++ {job}\n", *hunks))


def text_of(job: TrainingJob, layout: str) -> str:
    """Return the plan of a job in a layout as YAML."""
    return as_yaml(with_worlds_named(objects_of(job, layout)))


def comparable(job: TrainingJob, layout: str) -> str:
    """Return the plan of a job, with `HASH` wherever the plan has the hash of its ConfigMaps' data."""
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
    """Return the layout of that name, for a job."""
    if name == "cluster":
        return ClusterLayout(images=IMAGES)
    return LocalLayout(images=IMAGES, job_directory=f"/runs/{job.metadata.name}")


def with_worlds_named(objects: Iterable[Object]) -> list[Object]:
    """Return the objects with one line for each world, so that a plan can be read."""
    return [
        {**planned, "data": {key: named(key, text) for key, text in planned["data"].items()}}
        if "data" in planned
        else planned
        for planned in objects
    ]


def named(key: str, text: str) -> str:
    """Return the name, length and checksum of a text that is a world, and any other text unchanged."""
    if key == FILE:
        return text
    name = next((name for name in Builtin if builtin(name) == text.encode()), "the job's own world")
    return f"{name}, {len(text):,} characters, sha256 {hashlib.sha256(text.encode()).hexdigest()}"
