"""The worlds of a replica's ConfigMap: the source world of each group of simulators, once.

Each source is parsed and checked here, once for all replicas, so that what is wrong with it is known
before anything is created. Its sidecar alone writes the ROS names of a simulator into it; `file` sources
lie in the image, and are left to the sidecar altogether.
"""

from collections.abc import Mapping

from palaestra.api import Driver, SimulatorGroup, TrainingJob, World
from palaestra.errors import PlanError
from palaestra.plan.replica import PlannedSimulator, Replica
from palaestra_sim.world import MJCF, WBT, builtin, check, generate, suffix

MOST_BYTES = 900_000  # of all worlds; an object is 1 MiB at most, and training.yaml is in it too
FOLDER = "worlds"

_READ_MJCF = (Driver.MUJOCO, Driver.COMMAND)

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
        _require_reader(group, source, place)
        if source is None:
            continue
        if group.world.builtin is None and source not in checked:  # those that ship pass every check
            check(source, f"{field}.{_kind(group.world)}")
            checked.add(source)
        files[_of_group(group, source)] = source
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
    copies: dict[str, bytes] = {}
    for simulator in replica.simulators:
        source = _file_of(simulator.group, sources)
        if source is not None:
            copies[f"{simulator.name}{suffix(source)}"] = generate(
                source, simulator.identity, clock=simulator.keeps_clock
            )
    return copies if _size(copies) <= MOST_BYTES else sources


def world_path(replica: Replica, simulator: PlannedSimulator, files: Files) -> str:
    """Return the path of the world that a simulator's sidecar is given."""
    if simulator.group.world.file is not None:
        return simulator.group.world.file
    folder = f"{replica.places(simulator.container).config}/{FOLDER}"
    for stem in (simulator.name, simulator.group.name):
        for ending in (WBT, MJCF):
            if f"{stem}{ending}" in files:
                return f"{folder}/{stem}{ending}"
    return f"{folder}/{simulator.group.name}{WBT}"


def _of_group(group: SimulatorGroup, source: bytes) -> str:
    return f"{group.name}{suffix(source)}"


def _file_of(group: SimulatorGroup, sources: Files) -> bytes | None:
    """Return the world of a group; None: it lies in the image."""
    return next(
        (sources[name] for ending in (WBT, MJCF) if (name := f"{group.name}{ending}") in sources), None
    )


def _require_reader(group: SimulatorGroup, source: bytes | None, place: int) -> None:
    """Check that the simulator of a group reads worlds of this format.

    Raises:
        PlanError: the world is MJCF, and the driver reads no such world.
    """
    mjcf = group.world.file.endswith(MJCF) if group.world.file is not None else False
    if source is not None:
        mjcf = suffix(source) == MJCF
    if mjcf and group.driver not in _READ_MJCF:
        raise PlanError(
            f"spec.simulators[{place}].driver: {group.driver.value} reads no MJCF, and the world is a model "
            "of MuJoCo; set driver mujoco"
        )


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
