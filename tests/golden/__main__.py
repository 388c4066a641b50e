"""Record the generated files anew: `python -m tests.golden`.

- `tests/golden/<example>.<layout>.yaml`: the plan of each manifests/examples/*.yaml, worlds by checksum
- `manifests/crd.yaml`, docs/reference/trainingjob.md: made from the API's models
- `docs/reference/trainingjob.md`: the default hyperparameters of the algorithms
- `docs/reference/algorithms.md`: which algorithm works with which observations and actions
- `docs/reference/metrics.md`: every metric that the programs declare
- `docs/reference/simulators.md`: the devices of the stub
- `docs/reference/ros-interface.md`: the services and topics of a robot
- `docs/explain/judging.md`: the checks on a replica, in their order
- `charts/palaestra/README.md`: made from its values.yaml
- `charts/palaestra/dashboards/*.json`: made by tools/dashboards
- `manifests/install.yaml`: the chart with its default values, where Helm is built

A new example needs no new test: its plans are recorded here and compared by test_golden.py.
"""

import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from palaestra.api import load
from palaestra.api.generated_files import generated_files
from palaestra.plan import ClusterLayout, Images, LocalLayout, identified, plan
from palaestra.plan.yaml_text import as_yaml
from palaestra_sim.world import builtin
from tests.chart import installation, readme
from tests.control_plane.programs import NoPrograms
from tools import algorithms, dashboards
from tools.devices import page as devices
from tools.hyperparameters import page as hyperparameters
from tools.interface import page as interface
from tools.judging import page as judging
from tools.metrics import page as metrics

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "manifests" / "examples"
IMAGES = Images.of_release("0.0.0")  # of no release, so that a release changes no plan
SHIPPED = ("arena", "seeing")
UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"


def recorded() -> Iterator[tuple[Path, str]]:
    """Yield every generated file and what belongs into it."""
    for example in sorted(EXAMPLES.glob("*.yaml")):
        job = identified(load(example.read_text(), example.name), UID)
        layouts = {
            "cluster": ClusterLayout(images=IMAGES),
            "local": LocalLayout(images=IMAGES, job_directory=f"/runs/{job.metadata.name}"),
        }
        for name, layout in layouts.items():
            path = ROOT / "tests" / "golden" / f"{example.stem}.{name}.yaml"
            yield path, as_yaml(with_worlds_named(plan(job, layout).objects))
    for name, text in generated_files(ROOT).items():
        yield ROOT / name, text
    yield ROOT / hyperparameters.PAGE, hyperparameters.page((ROOT / hyperparameters.PAGE).read_text())
    yield ROOT / algorithms.PAGE, algorithms.page((ROOT / algorithms.PAGE).read_text())
    yield ROOT / metrics.PAGE, metrics.page((ROOT / metrics.PAGE).read_text())
    yield ROOT / judging.PAGE, judging.page((ROOT / judging.PAGE).read_text())
    yield ROOT / interface.PAGE, interface.page((ROOT / interface.PAGE).read_text())
    yield ROOT / devices.PAGE, devices.page((ROOT / devices.PAGE).read_text())
    for name, text in dashboards.generated_files().items():
        yield ROOT / name, text
    yield readme.PATH, readme.text()
    with suppress(NoPrograms):  # without Helm the file stays as it is; a change of the chart needs Helm
        yield installation.PATH, installation.text()


def with_worlds_named(objects: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the objects with one line for each world, so that a plan can be read."""
    return [
        {**planned, "data": {key: named(key, text) for key, text in planned["data"].items()}}
        if "data" in planned
        else planned
        for planned in objects
    ]


def named(key: str, text: str) -> str:
    """Return name, length and checksum of a world, any other text as it is."""
    if not key.endswith(".wbt"):
        return text
    name = next((name for name in SHIPPED if builtin(name) == text.encode()), "the job's own world")
    return f"{name}, {len(text):,} characters, sha256 {hashlib.sha256(text.encode()).hexdigest()}"


def main() -> int:
    """Write every file; plans of examples that are gone are removed."""
    current = set()
    for path, text in recorded():  # one by one: the installation is rendered from what stands before it
        path.write_text(text)
        current.add(path)
    for stale in set((ROOT / "tests" / "golden").glob("*.yaml")) - current:
        stale.unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main())
