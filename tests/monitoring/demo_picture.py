"""Record the page of `palaestra demo` in Chromium: `python -m tests.monitoring.demo_picture`.

docs/images/demo.gif    a training in the page, a click that kills its simulator, and the policy at the end
"""

from __future__ import annotations

import base64
import io
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image

from tests.browser import DRAWING, Page, browser
from tests.local_run import PALAESTRA, ROOT
from tests.waiting import eventually

PICTURE = ROOT / "docs/images/demo.gif"
WIDTH, HEIGHT = 1000, 560
SHOWN = (760, 426)  # pixels in the README
COLORS = 128
SAMPLES = 8  # the number of frames from which the common palette is computed
FRAME_MS, LAST_MS = 200, 1500
TRAINING, AFTER_THE_KILL, PLAYING = 12, 25, 40  # the number of frames of each part of the film
MOST_BYTES = 2_000_000
START_S, TRAIN_S = 120.0, 1200.0
CLICK = "[...document.querySelectorAll('button')].find(it => it.innerText === {!r}).click()"
TEXT = "document.body.innerText"


def main() -> int:
    """Record the page."""
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        _demo(Path(folder)) as printed,
        browser(Path(folder, "profile"), DRAWING) as page,
    ):
        frames = _film(page, printed)
    _write(frames)
    return 0


@contextmanager
def _demo(folder: Path) -> Iterator[Path]:
    """Start the demo, and yield the file with its output; Ctrl-C ends the demo."""
    output = folder / "output.txt"
    with output.open("w") as told:
        process = subprocess.Popen([PALAESTRA, "demo"], cwd=folder, stdout=told, stderr=told)
    try:
        yield output
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(START_S)


def _film(page: Page, printed: Path) -> list[Image.Image]:
    """Return the frames: a training, the simulator after a kill, and the policy."""
    page.show_as(width=WIDTH, height=HEIGHT, scheme="light")
    _show(page, printed, "demo")
    _await(page, "success ")
    page.evaluate("document.querySelector('.mantine-Notification-closeButton').click()")
    frames = _frames(page, TRAINING)
    page.evaluate(CLICK.format("kill it"))
    frames += _frames(page, AFTER_THE_KILL)
    _show(page, printed, "demo-plays")
    _await(page, "joint")
    page.evaluate("document.querySelector('.mantine-Notification-closeButton').click()")
    return frames + _frames(page, PLAYING)


def _show(page: Page, printed: Path, run: str) -> None:
    """Open the page of a run when the demo has printed its address."""
    address = re.compile(rf"(http://127\.0\.0\.1:\d+) shows \S+/{run}/0;")
    page.open_address(eventually(lambda: address.search(printed.read_text()), TRAIN_S)[1])


def _await(page: Page, text: str) -> None:
    """Wait until the page shows a text."""
    eventually(lambda: text in page.evaluate(TEXT), TRAIN_S)


def _frames(page: Page, count: int) -> list[Image.Image]:
    """Return pictures of the page, one each `FRAME_MS`, or fewer on a slow machine."""
    frames = []
    for _ in range(count):
        due = time.monotonic() + FRAME_MS / 1000
        picture = base64.b64decode(page.ask("Page.captureScreenshot")["data"])
        frames.append(Image.open(io.BytesIO(picture)).convert("RGB").resize(SHOWN, Image.Resampling.LANCZOS))
        time.sleep(max(0.0, due - time.monotonic()))
    return frames


def _write(frames: list[Image.Image]) -> None:
    """Write the film; all frames share one palette, so that parts without motion do not flicker."""
    few = frames[:: len(frames) // SAMPLES]
    sheet = Image.new("RGB", (SHOWN[0], SHOWN[1] * len(few)))
    for row, frame in enumerate(few):
        sheet.paste(frame, (0, row * SHOWN[1]))
    palette = sheet.quantize(COLORS)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [FRAME_MS] * (len(small) - 1) + [LAST_MS]
    small[0].save(PICTURE, save_all=True, append_images=small[1:], duration=durations, loop=0, optimize=False)
    size = PICTURE.stat().st_size
    assert size <= MOST_BYTES, f"{PICTURE} has {size} bytes; use fewer frames or colors"


if __name__ == "__main__":
    sys.exit(main())
