"""A checkout has the same bytes on every machine."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_a_checkout_with_autocrlf_has_no_crlf(tmp_path):
    """Git for Windows sets `core.autocrlf`, but bash, checksums and recorded files need LF."""
    clone = tmp_path / "clone"
    made = ["git", "-c", "core.autocrlf=true", "clone", "--quiet", "--shared", ROOT, clone]
    subprocess.run(made, check=True, timeout=60)

    listed = ["git", "ls-files", "--eol"]
    lines = subprocess.run(listed, cwd=clone, check=True, capture_output=True, text=True).stdout.splitlines()

    ends = {name: eol.split()[1] for eol, _, name in (line.partition("\t") for line in lines)}
    assert [name for name, end in ends.items() if end in {"w/crlf", "w/mixed"}] == []
    assert ends["tools/setup.sh"] == ends["sim_image/src/palaestra_sim/worlds/arena.wbt"] == "w/lf"
