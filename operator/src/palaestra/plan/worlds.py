"""The worlds of a replica's ConfigMap: one copy of the source world of each group of simulators.

Each source is checked once for all replicas, so that an error in a world is found before objects are created.
Either the plan checks the sources, or the operator checks them before the plan and passes the results
(verdicts). The key of a result is a digest of the world and of its field. Only the sidecar writes the ROS
names of a simulator into a world. A source of `file` is in the image, so only the sidecar reads it.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from palaestra.api import Driver, SimulatorGroup, TrainingJob, WorldSource
from palaestra.errors import PlanError, WorldCheckTooCostly, WorldRefused, WorldUnchecked
from palaestra.plan.replica import PlannedSimulator, Replica
from palaestra_sim.world import MJCF, WBT, builtin, check, suffix

# Limit for all worlds together; a ConfigMap has at most 1 MiB, and also contains training.yaml.
MOST_BYTES = 900_000
FOLDER = "worlds"

_READ_MJCF = (Driver.MUJOCO, Driver.COMMAND)

Verdicts = Mapping[str, "WorldVerdict"]  # keys: the digests of worlds
ConfigMaps = Mapping[tuple[str, str], bytes]  # (name, key) -> content
Files = Mapping[str, bytes]  # the content of a ConfigMap, by file name


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldVerdict:
    """The result of the check of one world.

    Attributes:
        problem: the error in the world; "": the world is valid.
        too_costly: whether the check was stopped because it exceeded its budget.
    """

    problem: str = ""
    too_costly: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenWorld:
    """A world that the author of a job wrote: its field in the spec, and its bytes."""

    field: str
    source: bytes

    @property
    def digest(self) -> str:
        """Return the key of the world's result in `Verdicts`."""
        return hashlib.sha256(b"\0".join((self.field.encode(), self.source))).hexdigest()


def require_fine(worlds: Mapping[str, GivenWorld], verdicts: Verdicts) -> None:
    """Check that every world has a result without a problem; the keys of `worlds` are digests.

    Raises:
        WorldCheckTooCostly: a check exceeded its budget.
        WorldRefused: a world is invalid.
        WorldUnchecked: a world has no result yet.
    """
    for digest in worlds:
        verdict = verdicts.get(digest)
        if verdict is not None and verdict.problem:
            raise (WorldCheckTooCostly if verdict.too_costly else WorldRefused)(verdict.problem)
    for digest, world in worlds.items():
        if digest not in verdicts:
            raise WorldUnchecked(world.field)


def source_files(job: TrainingJob, config_maps: ConfigMaps, verdicts: Verdicts | None = None) -> Files:
    """Return the checked source worlds for the ConfigMap of every replica.

    Without `verdicts` this function checks the worlds, which takes time in proportion to their size.

    Raises:
        PlanError: a ConfigMap is not among `config_maps`, the worlds are too big, or a result is missing or
            has a problem.
        WorldError: a world is invalid.
    """
    sources = _sources(job, config_maps)
    given = _given(job, sources)
    if verdicts is not None:
        require_fine({world.digest: world for world in given}, verdicts)
    else:
        for world in given:
            check(world.source, world.field)
    groups = job.spec.simulators
    return {_of_group(groups[place], source): source for place, source in sources.items()}


def given_worlds(job: TrainingJob, config_maps: ConfigMaps) -> tuple[GivenWorld, ...]:
    """Return the worlds of a job that must be checked before it is planned.

    Raises:
        PlanError: a ConfigMap is not among `config_maps`, or the worlds are too big.
    """
    return _given(job, _sources(job, config_maps))


def _given(job: TrainingJob, sources: Mapping[int, bytes]) -> tuple[GivenWorld, ...]:
    """Return the worlds that the author of a job wrote, each once; built-in worlds need no check."""
    worlds: dict[bytes, GivenWorld] = {}
    for place, source in sources.items():
        world = job.spec.simulators[place].world
        if world.builtin is None and source not in worlds:
            worlds[source] = GivenWorld(field=f"spec.simulators[{place}].world.{_kind(world)}", source=source)
    return tuple(worlds.values())


def _sources(job: TrainingJob, config_maps: ConfigMaps) -> Mapping[int, bytes]:
    """Return the source worlds by the number of their group, without worlds in an image.

    Raises:
        PlanError: a ConfigMap is not among `config_maps`, or the worlds are too big.
    """
    sources: dict[int, bytes] = {}
    for place, group in enumerate(job.spec.simulators):
        source = _source(group, f"spec.simulators[{place}].world", config_maps)
        _require_reader(group, source, place)
        if source is not None:
            sources[place] = source
    size = sum(
        len(_of_group(job.spec.simulators[place], each)) + len(each) for place, each in sources.items()
    )
    if size > MOST_BYTES:
        raise PlanError(
            f"spec.simulators: the worlds take {size} bytes, but only {MOST_BYTES} fit into a "
            "ConfigMap; put the worlds into the images and name them with world.file"
        )
    return sources


def world_path(replica: Replica, simulator: PlannedSimulator, files: Files) -> str:
    """Return the path of the world for a simulator's sidecar."""
    if simulator.group.world.file is not None:
        return simulator.group.world.file
    folder = f"{replica.places(simulator.container).config}/{FOLDER}"
    name = simulator.group.name
    return f"{folder}/{name}{MJCF if f'{name}{MJCF}' in files else WBT}"


def _of_group(group: SimulatorGroup, source: bytes) -> str:
    return f"{group.name}{suffix(source)}"


def _require_reader(group: SimulatorGroup, source: bytes | None, place: int) -> None:
    """Check that the simulator of a group reads worlds of this format.

    Raises:
        PlanError: the world is MJCF, which the driver does not read.
    """
    mjcf = group.world.file.endswith(MJCF) if group.world.file is not None else False
    if source is not None:
        mjcf = suffix(source) == MJCF
    if mjcf and group.driver not in _READ_MJCF:
        raise PlanError(
            f"spec.simulators[{place}].driver: {group.driver.value} cannot load the world, which is a model "
            "of MuJoCo (MJCF); set driver mujoco"
        )


def _source(group: SimulatorGroup, field: str, config_maps: ConfigMaps) -> bytes | None:
    """Return the content of a group's world; None if the world is in the image."""
    match group.world:
        case WorldSource(inline=str(text)):
            return text.encode()
        case WorldSource(builtin=str(name)):
            return builtin(name)
        case WorldSource(config_map=reference) if reference is not None:
            content = config_maps.get((reference.name, reference.key))
            if content is None:
                raise PlanError(
                    f"{field}.configMap: key {reference.key} of ConfigMap {reference.name} "
                    "can be read only in a cluster; use inline, builtin or file"
                )
            return content
        case _:
            return None


def _kind(world: WorldSource) -> str:
    """Return the name of the field that contains a world."""
    given = {"inline": world.inline, "configMap": world.config_map, "builtin": world.builtin}
    return next((name for name, value in given.items() if value is not None), "file")
