"""The simulators of a replica: groups of equal ones, their worlds and their lives."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.container import Environment, Resources
from palaestra.api.fields import (
    MAY_CHANGE,
    WORLD_FILE,
    Count,
    FileKey,
    GroupName,
    Image,
    Memory,
    Minutes,
    ObjectName,
    Seconds,
    Words,
)
from palaestra.api.model import ApiModel, Rule


class Role(StrEnum):
    """What a simulator's episodes are for."""

    COLLECT = "Collect"
    EVALUATE = "Evaluate"


class Driver(StrEnum):
    """Which program simulates."""

    STUB = "stub"
    WEBOTS = "webots"
    COMMAND = "command"


class Builtin(StrEnum):
    """The worlds that ship with Palaestra."""

    ARENA = "arena"


class ConfigMapKey(ApiModel):
    """A key of a ConfigMap in the job's own namespace.

    The ConfigMap must carry the label `palaestra.dev/for-jobs: "true"`: a TrainingJob opens nothing
    that its author could not open before.
    """

    name: ObjectName
    """Name of the ConfigMap."""

    key: FileKey
    """Key whose value is the text of a `.wbt` file."""


class World(ApiModel):
    """Where the source world comes from: exactly one of the four.

    Every simulator runs its own copy of it. Only the `controllerArgs` of robots whose controller is
    `ros` change: `--name=` is set, `--synchronize` is added, and `--clock` stays in one simulator at most.
    """

    inline: Annotated[str, Field(min_length=1, max_length=200_000)] | None = None
    """The text of a `.wbt` file. It names no other file: relative addresses are refused. If the inline
    worlds of a job have more than 256 KiB together, use `kubectl apply --server-side`."""

    config_map: ConfigMapKey | None = None
    """A ConfigMap that holds the text of a `.wbt` file; relative addresses are refused."""

    builtin: Builtin | None = Field(default=None, strict=False)
    """A world that ships with Palaestra: `arena`, four metres square, four cylinders, a Robotino."""

    file: Annotated[str, Field(max_length=1024, pattern=WORLD_FILE)] | None = None
    """Absolute path of a `.wbt` file inside the simulator's image (of this machine for
    `palaestra run`), whose PROTOs and textures lie beside it."""

    rules = (
        Rule(
            holds=lambda world: (
                sum(
                    source is not None
                    for source in (world.inline, world.config_map, world.builtin, world.file)
                )
                == 1
            ),
            cel=(
                "[has(self.inline), has(self.configMap), has(self.builtin), has(self.file)]"
                ".exists_one(given, given)"
            ),
            message="needs exactly one of inline, configMap, builtin and file; give one of them",
        ),
    )


class Recycle(ApiModel):
    """When a healthy simulator is started anew between two episodes: at the first limit reached."""

    after_resets: Count | None = None
    """Resets after which it is started anew; 0: never, absent: they are not counted."""

    after_minutes: Minutes | None = None
    """Minutes in use after which it is started anew; absent: never."""

    above_memory: Memory | None = None
    """Memory of all processes of one simulator above which it is started anew, as `400Mi`; absent:
    never. Give less than the limit in `resources`."""

    rules = (
        Rule(
            holds=lambda recycle: any(
                limit is not None
                for limit in (recycle.after_resets, recycle.after_minutes, recycle.above_memory)
            ),
            cel="has(self.afterResets) || has(self.afterMinutes) || has(self.aboveMemory)",
            message="sets no limit; give afterResets, afterMinutes or aboveMemory",
        ),
    )


class Restart(ApiModel):
    """How many faults of one simulator are survived."""

    limit: Annotated[int, Field(ge=0, le=1000)] = 10
    """Restarts after faults within the window; one more ends the replica (exit code 80), or with
    `minSimulators` left only this simulator."""

    within_seconds: Seconds = 600
    """Length of the window in seconds."""


class SimulatorGroup(ApiModel):
    """A group of equal simulators."""

    name: GroupName
    """Name of the group, unique in the job: a DNS label of at most 20 characters."""

    role: Role = Field(strict=False)
    """`Collect`: its episodes are learned from. `Evaluate`: they only measure the policy."""

    count: Annotated[int, Field(ge=1, le=16)] = 1
    """How many of them run in each replica."""

    min_simulators: Annotated[int, Field(ge=1, le=16)] | None = None
    """How many of them are enough to go on with: one whose restarts are used up is given up while
    as many are left, and training begins while others still come up; absent: all of them."""

    image: Image | None = None
    """Container image; absent: the one of this release for the driver. Not used by
    `palaestra run`."""

    driver: Driver = Field(default=Driver.STUB, strict=False)
    """`stub`: the simulator that ships with Palaestra. `webots`: Webots; its image is not built here
    yet, so give `image` one of yours. `command`: any program that speaks the same ROS interface."""

    command: Words = ()
    """The program and its arguments, for driver `command` only."""

    world: World = World(builtin=Builtin.ARENA)
    """The source world, from exactly one of four places."""

    recycle: Recycle | None = None
    """When a healthy simulator is started anew between two episodes; absent: after 24 resets, or never
    with driver `stub`, which neither leaks nor slows down."""

    standby: bool = False
    """True: a second simulator stands by in the same container and takes over at once when the first
    is recycled or fails. The container then has twice the memory."""

    options: Words = ()
    """Options for the simulator's own command line, each one word."""

    restart: Restart = Restart()
    """How many faults of one simulator are survived."""

    start_deadline_seconds: Seconds = Field(default=60, json_schema_extra={MAY_CHANGE: True})
    """Seconds that the trainer gives a simulator to come up, from when it asks for it; image pulls are not
    counted. The operator ends nothing by it."""

    env: Environment = ()
    """Environment variables of the simulator's container."""

    resources: Resources = Resources()
    """CPU and memory of one simulator; memory is doubled for a standby."""

    rules = (
        Rule(
            field="command",
            holds=lambda group: (group.driver is Driver.COMMAND) == bool(group.command),
            cel="(self.driver == 'command') == (size(self.command) > 0)",
            message="belongs to driver command, which needs one; set both or neither",
        ),
        Rule(
            field="image",
            holds=lambda group: group.driver is not Driver.COMMAND or group.image is not None,
            cel="self.driver != 'command' || has(self.image)",
            message="driver command has no image of its own; name the one that holds your program",
        ),
        Rule(
            field="minSimulators",
            holds=lambda group: group.min_simulators is None or group.min_simulators <= group.count,
            cel="!has(self.minSimulators) || self.minSimulators <= self.count",
            message="is more than the group has; lower it or raise count",
        ),
    )
