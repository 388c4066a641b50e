"""`palaestra explain`: the fields of a TrainingJob, and the guide for coding agents."""

import argparse
import json
import shutil
import sys
from importlib.resources import as_file, files

from palaestra.api.field_lookup import field_at
from palaestra.api.json_schema import json_schema
from palaestra.cli.subcommands import Commands, command
from palaestra.view.field_text import field_text

# Columns and lines if the output is not a terminal; the variable COLUMNS overrides the columns.
_WIDTH = (100, 24)
_NARROWEST, _WIDEST = 40, 110

EXPLAIN = """\
Prints the documentation of a field of a TrainingJob: type, default and meaning, the rules about the field,
and its inner fields. FIELD is a path with dots, such as spec.simulators or trainer.algorithm; `spec.` may be
left out, and an index is ignored. Without FIELD, the command documents the TrainingJob itself.
"""
EXIT_CODES = """\
exit codes:
  0    done
  2    a TrainingJob has no such field; the message has the nearest ones
"""
_SKILL = "SKILL.md"


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "explain", _explain, EXPLAIN, EXIT_CODES)
    parser.add_argument("field", metavar="FIELD", nargs="?", default="", help="such as trainer.algorithm")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--recursive", action="store_true", help="list all fields below, without their meaning")
    form.add_argument("--json", action="store_true", help="print a JSON Schema (draft 7), for editors")
    form.add_argument(
        "--skill", action="store_true", help="print the guide for coding agents; its path on standard error"
    )


def _explain(options: argparse.Namespace) -> int:
    if options.skill:
        return _skill()
    field = field_at(options.field)
    if options.json:
        sys.stdout.write(json.dumps(json_schema(field), indent=2, ensure_ascii=False) + "\n")
        return 0
    width = min(max(shutil.get_terminal_size(_WIDTH).columns, _NARROWEST), _WIDEST)
    sys.stdout.write(field_text(field, width, recursive=options.recursive))
    return 0


def _skill() -> int:
    with as_file(files("palaestra") / _SKILL) as path:
        sys.stdout.write(path.read_text(encoding="utf-8"))
        sys.stdout.flush()
        sys.stderr.write(f"{path}\n")
    return 0
