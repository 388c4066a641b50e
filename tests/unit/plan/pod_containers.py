"""Groups of simulators for plans, and the containers of a planned pod."""

TWO_GROUPS = [
    {"name": "collect", "role": "Collect", "count": 2},
    {"name": "evaluate", "role": "Evaluate"},
]
OWN = {"name": "own", "role": "Collect", "driver": "command", "image": "my:1", "command": ["sim"]}


def containers(planned) -> dict[str, dict]:
    """Return the containers of the first replica by name, in their start order."""
    spec = planned.replicas[0].job["spec"]["template"]["spec"]
    return {each["name"]: each for each in (*spec["initContainers"], *spec["containers"])}


def environment(container) -> dict[str, object]:
    """Return the environment variables of a container."""
    return {each["name"]: each.get("value", each.get("valueFrom")) for each in container["env"]}
