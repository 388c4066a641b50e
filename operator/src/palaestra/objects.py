"""Kubernetes objects as JSON data, and their keys: the types that all layers share."""

from collections.abc import Mapping
from typing import Any

Object = Mapping[str, Any]
Key = tuple[str, str]  # namespace and name
