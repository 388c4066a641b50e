"""Run one replica on this machine: its pods, one after another, by the rules of its planned Job."""

import asyncio
import contextlib
import json
import shutil
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palaestra.local.container import BackOff
from palaestra.local.errors import KILLED
from palaestra.local.files import make_folder, storage, write
from palaestra.local.interrupt import Interrupt
from palaestra.local.outcome import RunOutcome
from palaestra.local.output import Log, Show, say
from palaestra.local.pod import Kubelet, RunningPod
from palaestra.local.pod_spec import Pod, read_pod
from palaestra.local.retry_policy import Tries, verdict
from palaestra.plan import ReplicaPlan
from palaestra.plan.containers import BUILT_IN
from palaestra_protocol.pod.enums import SILENT
from palaestra_protocol.pod.status import ExitCode

FAILED = 1
DEADLINE_EXCEEDED = "DeadlineExceeded"
ENDED_BY_OTHERS = f"ProgramEnded: {SILENT}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """The folder of a replica, its output, and its deadline.

    `shown` has the functions that show a line of a container's output, by container. `terminal` is the
    descriptor of a terminal on which the trainer may draw, or None. `deadline_s` is the deadline for all pods
    together; None: no deadline.
    """

    directory: Path
    show: Show | None = None
    shown: Mapping[str, Show] = field(default_factory=dict)
    terminal: int | None = None
    backoff: BackOff = field(default_factory=BackOff)
    deadline_s: float | None = None


async def run_replica(planned: ReplicaPlan, setting: Setting) -> RunOutcome:
    """Run pods until the Job is complete, failed, interrupted or past its deadline; return the outcome.

    Raises:
        LocalError: a pod could not be started, or its files could not be written.
    """
    interrupt = Interrupt()
    tries = Tries(limit=planned.job["spec"]["backoffLimit"])
    pods = 0
    with interrupt.listening(setting.deadline_s):
        while True:
            pods += 1
            code = await _run_pod(planned, setting, interrupt)
            outcome = _outcome(planned, setting.directory, code, pods)
            if interrupt.asked.is_set():
                return _ended_early(outcome, interrupt)
            if not tries.another(verdict(planned.job, outcome.exit_code), outcome.steps or 0):
                return outcome
            say(
                f"the trainer ended with {meaning(outcome.exit_code)}; "
                f"the next attempt starts in {tries.wait_s:g} s"
            )
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(interrupt.asked.wait(), tries.wait_s)


def meaning(exit_code: int) -> str:
    """Return an exit code with its meaning, such as `exit code 82 (stalled)`."""
    try:
        return f"exit code {exit_code} ({ExitCode(exit_code).name.lower().replace('_', ' ')})"
    except ValueError:
        return f"exit code {exit_code}"


async def _run_pod(planned: ReplicaPlan, setting: Setting, interrupt: Interrupt) -> int | None:
    """Run one pod and return the trainer's exit code; None if the trainer was not started."""
    if interrupt.asked.is_set():
        return None
    template = planned.job["spec"]["template"]
    pod = read_pod(template, str(uuid.uuid4()))
    mount(pod, template["spec"]["volumes"], planned.config_map)
    _termination(setting.directory).unlink(missing_ok=True)
    with contextlib.ExitStack() as logs:
        kubelet = Kubelet(
            logs=_logs(pod, setting, logs),
            backoff=setting.backoff,
            show=setting.show,
            terminal=setting.terminal,
        )
        running = RunningPod(pod, kubelet)
        interrupt.pass_to(running)
        return await running.run()


def _logs(pod: Pod, setting: Setting, opened: contextlib.ExitStack) -> dict[str, Log]:
    folder = setting.directory / "logs"
    logs = {
        container.name: Log(container.name, folder, setting.shown.get(container.name))
        for container in pod.containers
    }
    for log in logs.values():
        opened.callback(log.close)
    return logs


def _ended_early(outcome: RunOutcome, interrupt: Interrupt) -> RunOutcome:
    """Return the outcome of a run that a signal or its deadline ended; a complete run stays complete.

    An interrupted trainer saves a checkpoint and exits with 75. If it exits with another code, that code
    stays.
    """
    if outcome.finished:
        return outcome
    outcome = replace(outcome, interrupted=interrupt.signals > 0)
    if interrupt.killed:
        return replace(outcome, exit_code=KILLED)
    if interrupt.expired:
        return replace(outcome, exit_code=FAILED, reason=DEADLINE_EXCEEDED)
    return outcome


def _outcome(planned: ReplicaPlan, directory: Path, code: int | None, pods: int) -> RunOutcome:
    """Return the outcome from the trainer's report, in summary.json or in its termination message.

    If the built-in loop exits with 0 but without a report, a library has ended the process.
    """
    word, summary = _json(_termination(directory)), _json(directory / "summary.json")
    said = {**word, **summary}
    code = int(ExitCode.INTERRUPTED) if code is None else code
    if code == ExitCode.DONE and not said and trains_by_itself(planned):
        code, said["reason"] = FAILED, ENDED_BY_OTHERS
    checkpoint = word.get("last_checkpoint")
    return RunOutcome(
        exit_code=code,
        reason=str(said.get("reason", "")),
        steps=said.get("step", said.get("steps")),
        saved=checkpoint.get("step") if isinstance(checkpoint, dict) else None,
        success_rate=said.get("success_rate"),
        steps_per_second=summary.get("steps_per_second"),
        trained_share=summary.get("trained_share"),
        faults=summary.get("faults"),
        pods=pods,
    )


def trains_by_itself(planned: ReplicaPlan) -> bool:
    """Return whether the trainer is the built-in loop, and not the job's own program."""
    (trainer,) = planned.job["spec"]["template"]["spec"]["containers"]
    return bool(trainer.get("command") == [BUILT_IN])


def _termination(directory: Path) -> Path:
    return directory / "termination.json"


def _json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError):  # the file is missing, or incomplete because its writer was killed
        return {}
    return content if isinstance(content, dict) else {}


def mount(pod: Pod, volumes: list[Mapping[str, Any]], config_map: Mapping[str, Any]) -> None:
    """Create each volume as a folder at its mount path; empty each emptyDir except the run directory.

    Raises:
        StorageFailed: a volume cannot be written.
    """
    for volume in volumes:
        target = Path(pod.mounts[volume["name"]])
        if "configMap" in volume:
            _show(volume["configMap"], config_map, target)
            continue
        if "emptyDir" in volume and volume["name"] != "run":
            with storage(target):
                shutil.rmtree(target, ignore_errors=True)
        make_folder(target)


def _show(source: Mapping[str, Any], config_map: Mapping[str, Any], target: Path) -> None:
    for item in source["items"]:
        write(target / item["path"], config_map["data"][item["key"]].encode())
