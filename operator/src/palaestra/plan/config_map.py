"""The ConfigMap of a replica: its training.yaml and the source worlds of its groups, as readable text."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from palaestra.plan.replica import Replica
from palaestra.plan.training import FILE, training_yaml
from palaestra.plan.worlds import FOLDER


def config_map(replica: Replica, worlds: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the immutable ConfigMap, whose name ends in a hash of its content."""
    data = {
        FILE: training_yaml(replica, worlds).decode(),
        **{name: content.decode() for name, content in worlds.items()},
    }
    digest = hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:10]
    return {
        "apiVersion": "v1",
        "kind": "ConfigMap",
        "metadata": replica.metadata(f"{replica.name}-{digest}"),
        "immutable": True,
        "data": data,
    }


def config_volume(planned: Mapping[str, Any]) -> dict[str, Any]:
    """Return the volume that mounts a ConfigMap as training.yaml and a folder of worlds."""
    return {
        "name": "config",
        "configMap": {
            "name": planned["metadata"]["name"],
            "items": [
                {"key": key, "path": key if key == FILE else f"{FOLDER}/{key}"} for key in planned["data"]
            ],
        },
    }
