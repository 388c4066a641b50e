"""`palaestra-conformance` compares a running simulator with the documented ROS interface."""

from __future__ import annotations

import argparse
import os
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from palaestra_protocol.pod.enums import ExitCode
from palaestra_trainer.errors import ConfigurationError, TrainerError
from palaestra_trainer.ros import ensure_node, is_served
from palaestra_trainer.ros.conformance import report
from palaestra_trainer.ros.conformance.claims import (
    TRAINING,
    Claims,
    ClaimVerdict,
    claims,
    subjects,
    verdicts,
)
from palaestra_trainer.ros.conformance.player import Player
from palaestra_trainer.ros.conformance.rehearsal import rehearsed
from palaestra_trainer.ros.conformance.wire_client import WireClient

CONFORMANCE = """\
Call every service of a running simulator, subscribe to every topic, and compare responses and messages with
docs/reference/ros-interface.md. The simulator must have loaded the world that --world writes for these
claims. With --claims training, the program calls only the services that a training needs, and drives the
robot as a training does.

reads:
  the ROS master; services and topics of the robot
writes:
  a line for each difference to standard output; with --report a file with a line for each claim. The
  simulator writes pictures into the folder of --files.
"""
EXIT_CODES = """\
exit codes:
  0   every claim holds
  1   some claims do not hold
  2   an option is wrong, no master responds, or the robot has no services; nothing was called
"""
DIFFERENT = 1
PICTURE = "logo.png"
# A PNG of one pixel.
_PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108020000009077"
    "53de0000000c4944415408d763f8cfc0000003010100c9fe92ef0000000049454e44ae426082"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-conformance`; return its exit code."""
    chosen = _parser().parse_args(arguments)
    asked = claims(chosen.claims)
    robot = chosen.name or asked.robot
    if chosen.world:
        return _write_world(asked, chosen.files, picture=chosen.claims != TRAINING)
    if chosen.master:
        os.environ["ROS_MASTER_URI"] = chosen.master
    try:
        ensure_node("palaestra_conformance")
        if not is_served(f"/{robot}/robot/time_step"):
            raise ConfigurationError(
                f"the robot {robot} has no services; start a simulator with the world that --world"
                " writes, and give the robot's ROS name with --name"
            )
    except TrainerError as error:
        sys.stderr.write(f"{error}\n")
        return ExitCode.CONFIGURATION
    return _reported(_played(asked, robot, chosen), chosen)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="palaestra-conformance",
        description=CONFORMANCE,
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--master", metavar="URI", help="address of the ROS master (default: $ROS_MASTER_URI)")
    add("--name", metavar="ROBOT", help="ROS name of the robot (default: its name in the world of --world)")
    add(
        "--claims",
        choices=subjects(),
        default="webots",
        help="claims to check: those of a simulator, or those that a training needs (default: webots)",
    )
    add(
        "--files", type=Path, default=Path(), metavar="DIR", help="folder of the world (default: this folder)"
    )
    add("--world", action="store_true", help="write the world for these claims into the folder, and exit")
    add("--all", action="store_true", help="also make the calls that restart and end the simulator")
    add("--report", type=Path, metavar="FILE", help="write a report in Markdown")
    return parser


def _write_world(asked: Claims, folder: Path, *, picture: bool) -> int:
    world = folder / f"{asked.robot}.wbt"
    try:
        if picture:
            (folder / PICTURE).write_bytes(_PNG)
        world.write_text(asked.world)
    except OSError as error:
        sys.stderr.write(f"--files: {error}; use a folder in which you can write\n")
        return ExitCode.CONFIGURATION
    sys.stdout.write(f"{world}\n")
    return 0


def _played(asked: Claims, robot: str, chosen: argparse.Namespace) -> list[ClaimVerdict]:
    client = WireClient()
    try:
        driven = rehearsed(client, asked, robot) if chosen.claims == TRAINING else []
        player = Player(client, robot, asked.step_ms, str(chosen.files.absolute()))
        answers, heard = player.play(asked, ending=chosen.all)
    finally:
        client.close()
    return [*driven, *verdicts(asked, answers, heard)]


def _reported(found: Sequence[ClaimVerdict], chosen: argparse.Namespace) -> int:
    sys.stdout.writelines(f"{line}\n" for line in (*report.differences(found), report.summary(found)))
    if chosen.report:
        facts = {
            "claims": chosen.claims,
            "palaestra-trainer": version("palaestra-trainer"),
            "system": f"{platform.system()} {platform.machine()}",
            "calls that restart and end the simulator": "made" if chosen.all else "left out",
        }
        try:
            chosen.report.write_text(report.markdown(found, facts))
        except OSError as error:
            sys.stderr.write(f"--report: {error}; name a file that can be written\n")
            return ExitCode.CONFIGURATION
    return DIFFERENT if any(verdict.problem for verdict in found) else 0


if __name__ == "__main__":
    sys.exit(main())
