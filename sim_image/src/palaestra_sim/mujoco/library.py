"""MuJoCo itself, whose compiled modules carry no types."""

from __future__ import annotations

import importlib
from typing import Any

mujoco: Any = importlib.import_module("mujoco")
