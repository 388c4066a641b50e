"""The worlds of a replica's ConfigMap: the source world of each group of simulators, once.

Each source is parsed and checked here, once for all replicas, so that what is wrong with it is known
before anything is created. Its sidecar alone writes the ROS names of a simulator into it; `file` sources
lie in the image, and are left to the sidecar altogether.
"""

from collections.abc import Mapping

from palaestra.api import SimulatorGroup, TrainingJob, World
from palaestra.errors import PlanError
from palaestra.plan.replica import PlannedSimulator, Replica
from palaestra_sim.world import builtin, check, generate

MOST_BYTES = 900_000  # of all worlds; an object is 1 MiB at most, and training.yaml is in it too
FOLDER = "worlds"

ConfigMaps = Mapping[tuple[str, str], bytes]  # (name, key) -> content
Files = Mapping[str, bytes]  # what goes into a ConfigMap, by file name


def source_files(job: TrainingJob, config_maps: ConfigMaps) -> Files:
    """Return the source worlds that go into the ConfigMap of every replica, each checked.

    Raises:
        PlanError: a ConfigMap is not among `config_maps`, or the worlds are too big.
        WorldError: a world is wrong.
    """
    files: dict[str, bytes] = {}
    checked: set[bytes] = set()
    for place, group in enumerate(job.spec.simulators):
        field = f"spec.simulators[{place}].world"
        source = _source(group, field, config_maps)
        if source is None:
            continue
        if group.world.builtin is None and source not in checked:  # those that ship pass every check
            check(source, f"{field}.{_kind(group.world)}")
            checked.add(source)
        files[_of_group(group)] = source
    if _size(files) > MOST_BYTES:
        raise PlanError(
            f"spec.simulators: their worlds take {_size(files)} bytes and {MOST_BYTES} fit in a "
            "ConfigMap; put the worlds into the images and name them with world.file"
        )
    return files


def named_files(replica: Replica, sources: Files) -> Files:
    """Return a replica's worlds as earlier versions put them into its ConfigMap.

    They wrote the names in already, a world for each simulator, unless those were too big together.
    A Job that mounts such a ConfigMap gets the same one again.
    """
    copies = {
        _of_simulator(simulator): generate(
            sources[_of_group(simulator.group)], simulator.identity, clock=simulator.keeps_clock
        )
        for simulator in replica.simulators
        if _of_group(simulator.group) in sources
    }
    return copies if _size(copies) <= MOST_BYTES else sources


def world_path(replica: Replica, simulator: PlannedSimulator, files: Files) -> str:
    """Return the path of the world that a simulator's sidecar is given."""
    if simulator.group.world.file is not None:
        return simulator.group.world.file
    own = _of_simulator(simulator)
    name = own if own in files else _of_group(simulator.group)
    return f"{replica.places(simulator.container).config}/{FOLDER}/{name}"


def _of_group(group: SimulatorGroup) -> str:
    return f"{group.name}.wbt"


def _of_simulator(simulator: PlannedSimulator) -> str:
    return f"{simulator.name}.wbt"


def _source(group: SimulatorGroup, field: str, config_maps: ConfigMaps) -> bytes | None:
    """Return the text of a group's world; None: it lies in the image."""
    match group.world:
        case World(inline=str(text)):
            return text.encode()
        case World(builtin=str(name)):
            return builtin(name)
        case World(config_map=reference) if reference is not None:
            content = config_maps.get((reference.name, reference.key))
            if content is None:
                raise PlanError(
                    f"{field}.configMap: ConfigMap {reference.name} has no key "
                    f"{reference.key} here; use inline, builtin or file"
                )
            return content
        case _:
            return None


def _kind(world: World) -> str:
    """Return the field that a world is given by."""
    given = {"inline": world.inline, "configMap": world.config_map, "builtin": world.builtin}
    return next((name for name, value in given.items() if value is not None), "file")


def _size(files: Files) -> int:
    return sum(len(name) + len(content) for name, content in files.items())
