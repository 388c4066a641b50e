"""`palaestra plan`, `world` and `crd`: commands that print text, and use neither a run nor a cluster."""

import argparse
import sys
from importlib.metadata import version
from pathlib import Path
from textwrap import indent

from palaestra.api.generated_files import crd_text
from palaestra.cli.files import add_dir, job, read
from palaestra.cli.subcommands import Commands, command
from palaestra.errors import PalaestraError
from palaestra.local.run_directory import job_directory, uid_of
from palaestra.local.world_check import check_world
from palaestra.plan import ClusterLayout, Images, Layout, LocalLayout, identified, plan
from palaestra.plan.yaml_text import as_yaml
from palaestra_protocol.numbers import whole
from palaestra_sim.world import RunIdentity, generate

_NOT_AS_IT_IS = 2
UNASSIGNED = "00000000-0000-0000-0000-000000000000"  # replaces the uid that a cluster would assign

PLAN = """\
Reads the TrainingJob in FILE and prints the Kubernetes objects that it needs, as YAML. Outside a cluster the
job has no uid yet, so the output contains zeros instead.
"""
WORLD = """\
Reads the world in FILE and prints the copy that one simulator of a job gets. Only the controllerArgs of
robots whose controller is "ros" change: --name= is set, --synchronize is added, and --clock is removed. With
the option --clock, the first --clock is kept.

With --check, the command instead prints what each simulator of this machine can and cannot do with the world,
and starts no simulator. The exit code is then 0 if each simulator can start the world with the given options,
and 2 otherwise.
"""
CRD = "Prints the CustomResourceDefinition of TrainingJobs, as YAML."


def add(commands: Commands) -> None:
    """Add the three commands."""
    _add_plan(commands)
    _add_world(commands)
    command(commands, "crd", _crd, CRD)


def _plan(options: argparse.Namespace) -> int:
    planned = job(options.file)
    images = Images.of_release(version("palaestra"))
    layout: Layout = ClusterLayout(images=images)
    uid = planned.metadata.uid or UNASSIGNED
    if options.layout == "local":
        directory = job_directory(options.dir, planned.metadata.name)
        layout, uid = LocalLayout(images=images, job_directory=str(directory)), uid_of(directory)
    sys.stdout.write(as_yaml(plan(identified(planned, uid), layout).objects))
    return 0


def _world(options: argparse.Namespace) -> int:
    if options.check:
        return _check(options)
    if options.job is None or options.group is None:
        raise PalaestraError("--job and --group: at least one of them is missing; give both, or use --check")
    identity = RunIdentity(
        job=options.job,
        namespace=options.namespace,
        uid=options.uid,
        replica=options.replica,
        group=options.group,
        index=options.index,
    )
    world = generate(
        read(options.file),
        identity,
        clock=options.clock,
        name=str(options.file),
        relative_addresses=True,
    )
    sys.stdout.write(world.decode())
    return 0


def _check(options: argparse.Namespace) -> int:
    """Let each simulator check a world with the given options, and print the results."""
    read(options.file)
    given = [word for name in options.leave_out for word in ("--leave-out", name)]
    given += [word for file in options.stand_ins for word in ("--stand-ins", str(file))]
    how = "with these options" if given else "as it is"
    answers = check_world(options.file, given)
    for answer in answers:
        verdict = f"starts {how}" if answer.starts else f"does not start {how}"
        sys.stdout.write(f"{answer.driver}: {verdict}\n{indent(answer.text, '  ')}\n")
    sys.stdout.write("webots: simulates all that its own files describe; its log has the errors of a world\n")
    return 0 if all(answer.starts for answer in answers) else _NOT_AS_IT_IS


def _crd(options: argparse.Namespace) -> int:
    del options
    sys.stdout.write(crd_text())
    return 0


def _add_plan(commands: Commands) -> None:
    parser = command(commands, "plan", _plan, PLAN)
    parser.add_argument("file", metavar="FILE", type=Path, help="a TrainingJob")
    parser.add_argument(
        "--layout",
        choices=("cluster", "local"),
        default="cluster",
        help="where the job runs; default: cluster",
    )
    add_dir(parser)


def _add_world(commands: Commands) -> None:
    parser = command(commands, "world", _world, WORLD)
    parser.add_argument("file", metavar="FILE", type=Path, help="a world (.wbt, or .xml of MuJoCo)")
    parser.add_argument(
        "--check", action="store_true", help="print what each simulator can and cannot do with it"
    )
    parser.add_argument(
        "--leave-out",
        action="append",
        default=[],
        metavar="TYPE",
        help="with --check: type that the simulator may leave out; repeatable; all: every type",
    )
    parser.add_argument(
        "--stand-ins",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="with --check: a table of stand-ins; repeatable",
    )
    parser.add_argument("--job", metavar="NAME", help="name of the job")
    parser.add_argument("--namespace", default="default", help="namespace of the job")
    parser.add_argument("--uid", default="", help="uid of the job in its cluster")
    parser.add_argument("--replica", type=whole(), default=0, help="number of the replica")
    parser.add_argument("--group", help="name of the group of simulators")
    parser.add_argument("--index", type=whole(), default=0, help="number of the simulator in the group")
    parser.add_argument("--clock", action="store_true", help="keep the world's first --clock")
