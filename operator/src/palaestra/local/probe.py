"""Run the probes of a container: check by a command or by HTTP whether it has started or is alive."""

import asyncio
import signal
import subprocess
import urllib.request
from collections.abc import Mapping
from http import HTTPStatus

from palaestra.local.pod_spec import Probe
from palaestra.local.process import Process

# This opener uses no proxy, because the address is on loopback.
DIRECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))


async def passes(probe: Probe, env: Mapping[str, str]) -> bool:
    """Try once, and return whether the try succeeds within the probe's timeout."""
    if probe.command:
        return await _command_succeeds(probe, env)
    return await asyncio.to_thread(_answers, probe.url, probe.timeout_s)


async def until_passed(probe: Probe, env: Mapping[str, str]) -> bool:
    """Try until a try succeeds; return False if the failure threshold is reached before."""
    await asyncio.sleep(probe.initial_delay_s)
    for failures in range(probe.failure_threshold):
        if failures:
            await asyncio.sleep(probe.period_s)
        if await passes(probe, env):
            return True
    return False


async def until_failed(probe: Probe, env: Mapping[str, str]) -> None:
    """Return as soon as the number of consecutive failed tries reaches the threshold."""
    await asyncio.sleep(probe.initial_delay_s)
    failures = 0
    while failures < probe.failure_threshold:
        failures = 0 if await passes(probe, env) else failures + 1
        await asyncio.sleep(probe.period_s)


async def _command_succeeds(probe: Probe, env: Mapping[str, str]) -> bool:
    """Run the command and return whether it succeeds; kill it after a timeout or a cancellation."""
    process = Process.start(probe.command, env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        return await process.ended_within(probe.timeout_s) and await process.wait() == 0
    finally:
        process.send(signal.SIGKILL)


def _answers(url: str, timeout_s: float) -> bool:
    """Return whether the response to a GET request has an HTTP status from 200 to 399."""
    try:
        with DIRECT.open(url, timeout=timeout_s) as answer:
            return bool(answer.status < HTTPStatus.BAD_REQUEST)  # the same rule as in the kubelet
    except OSError:  # the connection was refused or timed out, or the HTTP status is an error
        return False
