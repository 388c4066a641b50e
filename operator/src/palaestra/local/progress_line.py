"""The progress of a run as lines for a person: steps, success rate, speed, faults and remaining time."""

import asyncio

from palaestra.local.output import Show
from palaestra.local.progress import ProgressReader, RunProgress

EVERY_S = 10.0
FIRST_S = 1.0
BETWEEN = " · "
_TRAINING = "training"
_MINUTE_S = 60


def progress_line(progress: RunProgress) -> str:
    """Return the progress as one line, without unknown values.

    For example: step 12,500 of 50,000 · 96 % (87 to 99) of 50 episodes · 122 steps/s · 0 faults · 5 min left
    """
    parts = (
        f"step {progress.step:,} of {progress.target:,}",
        _success(progress),
        "" if progress.steps_per_second is None else f"{progress.steps_per_second:.0f} steps/s",
        f"{progress.faults:,} fault{'' if progress.faults == 1 else 's'}",
        _left(progress),
        "" if progress.phase == _TRAINING else progress.phase,
    )
    return BETWEEN.join(part for part in parts if part)


async def show_progress(
    reader: ProgressReader, show: Show, every_s: float = EVERY_S, first_s: float = FIRST_S
) -> None:
    """Show a line at the trainer's first response, and then every `every_s` seconds, until cancelled.

    Until that response, send a request every `first_s` seconds. While the trainer does not respond, as
    between two attempts, show nothing, because its speed and its remaining time are old.
    """
    wait_s, shown = first_s, RunProgress()
    while True:
        await asyncio.sleep(wait_s)
        # The request runs in a thread, because the trainer may take seconds to respond. Meanwhile the event
        # loop must serve the pod.
        progress = await asyncio.to_thread(reader.progress)
        if progress.target and progress is not shown:
            show(progress_line(progress))
            wait_s, shown = every_s, progress


def _success(progress: RunProgress) -> str:
    """Return the success rate of the last evaluation, in percent, with its interval."""
    rate, interval = progress.success_rate, progress.success_interval
    if rate is None:
        return ""
    if interval is None:
        return f"{100 * rate:.0f} %"
    bounds = f"{100 * interval.low:.0f} to {100 * interval.high:.0f}"
    return f"{100 * rate:.0f} % ({bounds}) of {interval.episodes} episodes"


def _left(progress: RunProgress) -> str:
    """Return the text about the time until the last step at the present speed, or ""."""
    left = progress.target - progress.step
    if not progress.steps_per_second or left <= 0:
        return ""
    left_s = left / progress.steps_per_second
    if left_s < _MINUTE_S:
        return f"{left_s:.0f} s left"
    hours, minutes = divmod(round(left_s / _MINUTE_S), 60)
    return f"{hours} h {minutes} min left" if hours else f"{minutes} min left"
