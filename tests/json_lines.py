"""Files of JSON lines that another program is writing."""

import json
from pathlib import Path
from typing import Any


def whole_lines(path: Path, about: str = "") -> list[dict[str, Any]]:
    """Return the parsed lines that contain `about`, except a last line that is still being written."""
    lines = path.read_bytes().splitlines(keepends=True)
    return [json.loads(line) for line in lines if line.endswith(b"\n") and about.encode() in line]
