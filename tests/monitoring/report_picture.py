"""Take a picture of a run's report in Chromium: `python -m tests.monitoring.report_picture RUN`.

docs/images/report.png    the upper part of RUN/report.html in light colors, in a window for a desktop
"""

import base64
import sys
import tempfile
from pathlib import Path

from tests.browser import DRAWING, browser
from tests.local_run import ROOT

PICTURE = ROOT / "docs/images/report.png"
WIDTH, HEIGHT = 1100, 1010


def main(run: str) -> int:
    """Take the picture."""
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        browser(Path(profile), DRAWING) as page,
    ):
        page.show_as(width=WIDTH, height=HEIGHT, scheme="light")
        page.open(Path(run).absolute() / "report.html")
        page.evaluate(
            "document.querySelectorAll('.at').forEach(one => {"
            "  one.value = one.max * 0.4; one.dispatchEvent(new Event('input')); })"
        )
        page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        PICTURE.write_bytes(base64.b64decode(page.ask("Page.captureScreenshot")["data"]))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
