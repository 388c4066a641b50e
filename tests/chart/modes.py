"""The chart's values for each kind of installation in docs/howto/install.md."""

from typing import Any

Values = dict[str, Any]
PARTS = ("operator", "trainer", "stub", "mujoco", "webots", "notebook")
DIGEST = "sha256:" + "0" * 64

MODES: dict[str, Values] = {
    "default": {},
    "namespaced": {"watchNamespaces": ["robots", "drones"], "crds": {"install": False}},
    "available": {"operator": {"replicas": 3}},
    "monitored": {
        "monitoring": {
            "podMonitor": {"enabled": True, "labels": {"release": "prometheus"}},
            "serviceMonitor": {"enabled": True},
            "prometheusRule": {"enabled": True},
            "dashboards": {"enabled": True, "annotations": {"grafana_folder": "Palaestra"}},
        }
    },
    "offline": {
        "images": {
            "registry": "registry.example.com:5000/robots",
            **{part: {"digest": DIGEST} for part in PARTS},
            "webots": {"repository": "palaestra-webots", "digest": DIGEST},
        },
        "imagePullSecrets": [{"name": "registry"}],
        "tensorboard": {"enabled": True, "existingClaim": "runs"},
        "jupyter": {"enabled": True, "tokenSecret": {"name": "notebooks"}},
    },
    "closed": {
        "networkPolicy": {"egress": {"restricted": True}},
        "operator": {
            "priorityClassName": "system-cluster-critical",
            "nodeSelector": {"kubernetes.io/os": "linux"},
            "tolerations": [{"key": "dedicated", "operator": "Exists"}],
            "affinity": {"nodeAffinity": {}},
            "podAnnotations": {"example.com/team": "robots"},
            "podLabels": {"team": "robots"},
            "hostUsers": False,
        },
        "jobs": {
            "allowedPodLabels": ["example.com/"],
            "allowedPodAnnotations": ["example.com/", "note"],
            "allowedPriorityClasses": ["urgent"],
            "allowedRuntimeClasses": ["nvidia"],
            "allowedTolerations": ["dedicated", "example.com/"],
            "allowedAffinityNamespaces": ["storage"],
            "allowedAntiAffinityLabels": ["palaestra.dev/job"],
            "nodeSelector": {"kubernetes.io/os": "linux"},
            "hostUsers": False,
            "resources": {"rosMaster": {"limits": {"cpu": 1, "memory": "128Mi"}}},
        },
        "serviceAccount": {"create": False, "name": "existing"},
    },
}


def merged(*parts: Values) -> Values:
    """Return all values merged; a later part overrides an earlier one."""
    whole: Values = {}
    for part in parts:
        for key, value in part.items():
            both = isinstance(value, dict) and isinstance(whole.get(key), dict)
            whole[key] = merged(whole[key], value) if both else value
    return whole


MODES["everything"] = merged(*(MODES[each] for each in ("available", "monitored", "offline", "closed")))
MODES["everything, namespaced"] = merged(MODES["everything"], MODES["namespaced"])
