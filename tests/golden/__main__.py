"""Write all generated files again: `python -m tests.golden`.

- `tests/golden/`: the plans of the examples and of the cases, see `plans.py`
- `manifests/crd.yaml`, docs/reference/trainingjob.md: from the models of the API
- `docs/reference/trainingjob.md`: the default hyperparameters of the algorithms
- `docs/reference/algorithms.md`: the observations and actions that each algorithm supports
- `docs/reference/metrics.md`: every metric that the programs declare
- `docs/reference/simulators.md`: the devices of the stub
- `docs/reference/ros-interface.md`: the services and topics of a robot
- `trainer/src/palaestra_trainer/ros/conformance/interface.json`: the claims of that page as data
- `docs/explain/judging.md`: the checks on a replica, in their order
- `docs/explain/peers.md`: the comparisons that are recorded in docs/explain/peers.json
- `llms.txt`: the pages that docs/README.md links to
- `charts/palaestra/README.md`: from the chart's values.yaml
- `charts/palaestra/dashboards/*.json`: from tools/dashboards
- `manifests/install.yaml`: the chart with its default values, if Helm is built

A new example or case needs no new test: this program writes its plans, and test_golden.py compares them.
"""

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from palaestra.api.generated_files import generated_files
from tests.chart import installation, readme
from tests.control_plane.programs import NoPrograms
from tests.golden import plans
from tools import algorithms, dashboards
from tools.devices import page as devices
from tools.hyperparameters import page as hyperparameters
from tools.interface import page as interface
from tools.judging import page as judging
from tools.llms import page as llms
from tools.metrics import page as metrics
from tools.peers import page as peers

ROOT = Path(__file__).parents[2]


def recorded() -> Iterator[tuple[Path, str]]:
    """Yield the path and the content of every generated file."""
    yield from plans.recorded()
    for name, text in generated_files(ROOT).items():
        yield ROOT / name, text
    yield ROOT / hyperparameters.PAGE, hyperparameters.page((ROOT / hyperparameters.PAGE).read_text())
    yield ROOT / algorithms.PAGE, algorithms.page((ROOT / algorithms.PAGE).read_text())
    yield ROOT / metrics.PAGE, metrics.page((ROOT / metrics.PAGE).read_text())
    yield ROOT / judging.PAGE, judging.page((ROOT / judging.PAGE).read_text())
    yield ROOT / peers.PAGE, peers.page((ROOT / peers.PAGE).read_text(), ROOT)
    yield ROOT / interface.PAGE, interface.page((ROOT / interface.PAGE).read_text())
    yield ROOT / interface.INTERFACE, interface.interface_file()
    yield ROOT / devices.PAGE, devices.page((ROOT / devices.PAGE).read_text())
    yield ROOT / llms.PAGE, llms.page(ROOT)
    for name, text in dashboards.generated_files().items():
        yield ROOT / name, text
    yield readme.PATH, readme.text()
    with suppress(NoPrograms):  # without Helm, the file is not written
        yield installation.PATH, installation.text()


def main() -> int:
    """Write every file, and remove the recorded plans of examples and cases that no longer exist."""
    current = set()
    for path, text in recorded():  # one by one, because the installation is rendered from the files before it
        path.write_text(text)
        current.add(path)
    for stale in plans.on_disk() - current:
        stale.unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main())
