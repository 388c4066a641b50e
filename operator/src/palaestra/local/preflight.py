"""Checks before the start of a run; each reported problem has a remedy."""

import fcntl
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

from palaestra.api import Driver, SimulatorGroup, TrainingJob
from palaestra.local.errors import RunRefused
from palaestra.local.files import without_locks
from palaestra.local.run_directory import job_directory
from palaestra.local.simulators import PROGRAMS, lack
from palaestra_protocol.linux import lack_of_linux
from palaestra_protocol.policy_package import MODEL, PackageError, is_package, read_package
from palaestra_protocol.shadowing import shadows
from palaestra_sim import world
from palaestra_sim.errors import RootError, WorldError
from palaestra_sim.world.bounded_read import read_bounded

LEAST_FREE = 100 * 2**20  # bytes; logs and three checkpoints of an example take 40 MB
PYTHON_PATH = "PYTHONPATH"
POLICY = "policy.pth"  # the file with the policy's tensors in a zip of Stable-Baselines3
INSTALLATION = "this installation"


@dataclass(frozen=True, slots=True, kw_only=True)
class PreflightRequest:
    """The job to run, and the folder of its runs."""

    job: TrainingJob
    runs: Path


Check = Callable[[PreflightRequest], Iterator[str]]
ENVIRONMENT = Path("/proc/self/environ")


def check(request: PreflightRequest) -> None:
    """Run every check.

    Raises:
        RunRefused: a check failed; the message has one line for each problem.
    """
    if problems := [problem for check in CHECKS for problem in check(request)]:
        raise RunRefused("\n".join(problems))


def processes_can_be_found(request: PreflightRequest) -> Iterator[str]:
    """The system has Linux' /proc, in which the runner finds the processes that a container left behind."""
    del request
    if (problem := lack_of_linux()) is not None:
        yield f"a run on this machine {problem}"
        return
    try:
        ENVIRONMENT.read_bytes()
    except OSError as error:
        yield f"{ENVIRONMENT}: {error.strerror}; run on Linux with /proc, as in a container or WSL 2"


def no_module_is_shadowed(request: PreflightRequest) -> Iterator[str]:
    """No module on PYTHONPATH has the same name as a module that the ROS master or the trainer needs."""
    own = (each.value for each in request.job.spec.trainer.env if each.name == PYTHON_PATH)
    for python_path in {os.environ.get(PYTHON_PATH, ""), *own}:
        yield from shadows(python_path or "")


def nothing_is_put_off(request: PreflightRequest) -> Iterator[str]:
    """The job is not suspended, because a local run has no operator to resume it."""
    if request.job.spec.suspend:
        yield "spec.suspend: is true, so the job would not train; set it to false to train now"


def programs_exist(request: PreflightRequest) -> Iterator[str]:
    """The program of each container is installed, with the library that it needs."""
    spec = request.job.spec
    own = spec.trainer.command[:1]
    programs = {"palaestra-ros-master": INSTALLATION, "palaestra-sidecar": INSTALLATION}
    programs.update({own[0]: "spec.trainer.command"} if own else {"palaestra-train": INSTALLATION})
    for index, group in enumerate(spec.simulators):
        programs[_simulator_program(group)] = f"spec.simulators[{index}]"
    for program, field in programs.items():
        if (problem := lack(program)) is not None:
            yield f"{field}: {problem}"


def worlds_are_right(request: PreflightRequest) -> Iterator[str]:
    """Each world in a file is valid; without this check, only the sidecar would find an error."""
    for index, group in enumerate(request.job.spec.simulators):
        if group.world.file is not None:
            field = f"spec.simulators[{index}].world"
            root = None if group.world.root is None else Path(group.world.root)
            yield from (f"{field}.{problem}" for problem in _problems(Path(group.world.file), root))


def initial_policy_is_there(request: PreflightRequest) -> Iterator[str]:
    """The file of the initial policy is a package, or a zip with a policy's tensors.

    The trainer checks the shapes of the tensors.

    The file may be missing if every replica has a checkpoint, because replicas then resume from their
    checkpoints.
    """
    initial = request.job.spec.trainer.initial_policy
    if initial is None:
        return
    try:
        if is_package(Path(initial.path)):
            read_package(Path(initial.path), MODEL)
            return
        with zipfile.ZipFile(initial.path) as archive:
            archive.getinfo(POLICY)
    except PackageError as error:
        yield f"spec.trainer.initialPolicy.path: {error}"
    except OSError as error:
        if not _all_have_learned(request):
            yield f"spec.trainer.initialPolicy.path: {initial.path}: {error.strerror}; name a model.zip"
    except (zipfile.BadZipFile, KeyError):
        yield (
            f"spec.trainer.initialPolicy.path: {initial.path}: is not a model of Stable-Baselines3; "
            "name a model.zip"
        )


def space_is_left(request: PreflightRequest) -> Iterator[str]:
    """The disk has space for the run."""
    folder = _existing(request.runs)
    if not os.access(folder, os.W_OK):
        yield f"{folder}: cannot be written; choose another folder with --dir"
    elif (free := shutil.disk_usage(folder).free) < LEAST_FREE:
        yield (
            f"{folder}: {free // 2**20} MiB are free, but a run needs {LEAST_FREE // 2**20} MiB; "
            "free some space, or choose another folder with --dir"
        )


def locks_work(request: PreflightRequest) -> Iterator[str]:
    """The file system of the runs supports locks; the check locks a temporary file without a name."""
    folder = _existing(request.runs)
    # If the folder is not writable, `space_is_left` reports that.
    with suppress(OSError), TemporaryFile(dir=folder) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            yield without_locks(folder, error)


CHECKS: tuple[Check, ...] = (
    processes_can_be_found,
    no_module_is_shadowed,
    nothing_is_put_off,
    programs_exist,
    worlds_are_right,
    initial_policy_is_there,
    space_is_left,
    locks_work,
)


def _existing(path: Path) -> Path:
    """Return the path if it exists; otherwise return its nearest existing parent."""
    return next(parent for parent in (path, *path.parents) if parent.exists())


def _all_have_learned(request: PreflightRequest) -> bool:
    directory = job_directory(request.runs, request.job.metadata.name)
    runs = (directory / str(replica) for replica in range(request.job.spec.replicas))
    return all(any((run / "checkpoints").glob("[0-9]*")) for run in runs)


def _simulator_program(group: SimulatorGroup) -> str:
    return group.command[0] if group.driver is Driver.COMMAND else PROGRAMS[group.driver]


def _problems(path: Path, root: Path | None) -> Iterator[str]:
    try:
        source = read_bounded(path)
        world.check(source, str(path), relative_addresses=True)
        world.root_of(world.placed(path), source, root)
    except OSError as error:
        yield f"file: {error.filename}: {error.strerror}; name a world of this machine"
    except WorldError as error:
        yield f"file: {error}"
    except RootError as error:
        yield f"root: {error}"
