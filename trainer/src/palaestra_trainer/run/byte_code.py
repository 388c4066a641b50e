"""Find byte code in a model.zip; only the version of Python that wrote the byte code can run it.

Stable-Baselines3 pickles each value that JSON cannot write. A function or class that cannot be imported by
name is stored as byte code. If another version of Python executes this code, it raises SystemError or
crashes. The trainer's own values are names and numbers, but a job's author may use a class that cannot be
imported by name.
"""

from __future__ import annotations

import base64
import json
import pickletools
import re
import sys
import zipfile
from pathlib import Path

from palaestra_trainer.errors import ConfigurationError

_SERIALIZED = ":serialized:"
_PICKLER = "cloudpickle"  # a pickle names cloudpickle only if it creates functions or classes


def refuse_another_python(model: Path) -> None:
    """Check that this version of Python can run all values of a model.zip.

    Raises:
        ConfigurationError: another version of Python wrote byte code into the file.
    """
    with zipfile.ZipFile(model) as archive:
        written_by = _python(archive)
        coded = [] if written_by in {"", _this_python()} else _with_code(archive)
    if coded:
        raise ConfigurationError(
            f"{model}: {' and '.join(coded)} has byte code of Python {written_by}, but this is Python "
            f"{_this_python()}; use Python {written_by}, or export the policy there"
        )


def _this_python() -> str:
    return f"{sys.version_info.major}.{sys.version_info.minor}"


def _python(archive: zipfile.ZipFile) -> str:
    """Return the version of Python that wrote a file, as Stable-Baselines3 stored it; "" if not stored."""
    name = "system_info.txt"
    text = archive.read(name).decode() if name in archive.namelist() else ""
    found = re.search(r"Python: (\d+\.\d+)", text)
    return found[1] if found else ""


def _with_code(archive: zipfile.ZipFile) -> list[str]:
    data = json.loads(archive.read("data"))
    return [
        name
        for name, value in data.items()
        if isinstance(value, dict) and _SERIALIZED in value and _is_code(base64.b64decode(value[_SERIALIZED]))
    ]


def _is_code(pickled: bytes) -> bool:
    """Return whether a pickle creates a function or class, without unpickling it."""
    texts = (argument for _, argument, _ in pickletools.genops(pickled) if isinstance(argument, str))
    return any(text.partition(".")[0] == _PICKLER for text in texts)
