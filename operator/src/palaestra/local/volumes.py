"""The volumes of a planned pod as folders: the files of a ConfigMap, a claim, empty folders."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from palaestra.local.files import make_folder, storage, write
from palaestra.local.pod_spec import Pod


def mount(pod: Pod, volumes: list[Mapping[str, Any]], config_map: Mapping[str, Any]) -> None:
    """Create every volume at its mount path in the pod; an emptyDir is emptied for each pod.

    Raises:
        StorageFailed: a volume cannot be written.
    """
    for volume in volumes:
        target = Path(pod.mounts[volume["name"]])
        if "configMap" in volume:
            _show(volume["configMap"], config_map, target)
            continue
        if "emptyDir" in volume and volume["name"] != "run":
            with storage(target):
                shutil.rmtree(target, ignore_errors=True)
        make_folder(target)


def _show(source: Mapping[str, Any], config_map: Mapping[str, Any], target: Path) -> None:
    for item in source["items"]:
        write(target / item["path"], config_map["data"][item["key"]].encode())
