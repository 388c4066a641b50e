"""The worlds of a replica: each simulator's own, generated from its group's source.

`file` sources are left to the sidecar, which can see the file and what lies beside it. Where the
copies of all simulators would not fit in a ConfigMap, each source goes in once and the sidecar, which
runs the same generator on whatever it is given, makes the copies.
"""

from collections.abc import Mapping

from palaestra.api import World
from palaestra.plan.errors import PlanError
from palaestra.plan.replica import Replica, Simulator
from palaestra_sim.world import builtin, generate

MOST_BYTES = 900_000  # of all worlds; an object is 1 MiB at most, and training.yaml is in it too
FOLDER = "worlds"

ConfigMaps = Mapping[tuple[str, str], bytes]  # (name, key) -> content


def world_files(replica: Replica, config_maps: ConfigMaps) -> dict[str, bytes]:
    """Return the worlds that go into the replica's ConfigMap, by file name.

    Raises:
        PlanError: a ConfigMap is not among `config_maps`, or the worlds are too big.
        WorldError: a world is wrong.
    """
    sources = {
        simulator.group.name: source
        for simulator in replica.simulators
        if (source := _source(replica, simulator, config_maps)) is not None
    }
    copies = {
        f"{simulator.name}.wbt": generate(
            sources[simulator.group.name],
            simulator.identity,
            clock=simulator.keeps_clock,
            name=_field(replica, simulator),
        )
        for simulator in replica.simulators
        if simulator.group.name in sources
    }
    if _size(copies) <= MOST_BYTES:
        return copies
    once = {f"{group}.wbt": source for group, source in sources.items()}
    if _size(once) > MOST_BYTES:
        raise PlanError(
            f"spec.simulators: their worlds take {_size(once)} bytes and {MOST_BYTES} fit in a "
            "ConfigMap; put the worlds into the images and name them with world.file"
        )
    return once


def world_path(replica: Replica, simulator: Simulator, files: Mapping[str, bytes]) -> str:
    """Return the path of the world that a simulator's sidecar is given."""
    if simulator.group.world.file is not None:
        return simulator.group.world.file
    own = f"{simulator.name}.wbt"
    name = own if own in files else f"{simulator.group.name}.wbt"
    return f"{replica.places(simulator.container).config}/{FOLDER}/{name}"


def _source(replica: Replica, simulator: Simulator, config_maps: ConfigMaps) -> bytes | None:
    match simulator.group.world:
        case World(inline=str(text)):
            return text.encode()
        case World(builtin=str(name)):
            return builtin(name)
        case World(config_map=reference) if reference is not None:
            content = config_maps.get((reference.name, reference.key))
            if content is None:
                raise PlanError(
                    f"{_field(replica, simulator)}: ConfigMap {reference.name} has no key "
                    f"{reference.key} here; use inline, builtin or file"
                )
            return content
        case _:
            return None


def _field(replica: Replica, simulator: Simulator) -> str:
    """Return the field of the job that a simulator's world comes from."""
    position = replica.job.spec.simulators.index(simulator.group)
    world = simulator.group.world
    given = {"inline": world.inline, "configMap": world.config_map, "builtin": world.builtin}
    kind = next((name for name, value in given.items() if value is not None), "file")
    return f"spec.simulators[{position}].world.{kind}"


def _size(files: Mapping[str, bytes]) -> int:
    return sum(len(name) + len(content) for name, content in files.items())
