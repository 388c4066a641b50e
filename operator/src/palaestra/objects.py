"""The types of Kubernetes objects as JSON data, and of their keys; all layers share these types."""

from collections.abc import Mapping
from typing import Any

Object = Mapping[str, Any]
Key = tuple[str, str]  # namespace and name
