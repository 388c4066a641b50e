"""The simulators of a replica: groups, worlds, recycling and restarts."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.container import Environment, Resources
from palaestra.api.fields import (
    ABSOLUTE_FOLDER,
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
from palaestra.api.passwords import NO_PASSWORD_IN_COMMAND, NO_PASSWORD_IN_WORDS
from palaestra_protocol.batch import MOST_ROWS
from palaestra_protocol.pod.enums import Role


class Driver(StrEnum):
    """The simulator program."""

    STUB = "stub"
    MUJOCO = "mujoco"
    WEBOTS = "webots"
    COMMAND = "command"


class Builtin(StrEnum):
    """The worlds that ship with Palaestra."""

    ARENA = "arena"
    SEEING = "seeing"
    COURT = "court"
    PEN = "pen"


class ConfigMapKey(ApiModel):
    """A key of a ConfigMap in the job's own namespace.

    The ConfigMap must have the label `palaestra.dev/for-jobs: "true"`. Otherwise an author of TrainingJobs
    could read ConfigMaps to which they have no access.
    """

    name: ObjectName
    """Name of the ConfigMap."""

    key: FileKey
    """Key whose value is the text of a `.wbt` file, or of a model of MuJoCo."""


class WorldSource(ApiModel):
    """The source of the world: exactly one of four.

    Every simulator runs its own copy. In the copy, only the `controllerArgs` of robots whose controller is
    `ros` change: `--name=` is set, `--synchronize` is added, and at most one simulator keeps `--clock`. A
    model of MuJoCo has these arguments in `<text name="controllerArgs">` inside of `<custom>`.
    """

    inline: Annotated[str, Field(min_length=1, max_length=200_000)] | None = None
    """Text of a `.wbt` file, or of a model of MuJoCo (MJCF) with driver `mujoco`. It must not refer to
    other files: relative URLs are refused. If the inline worlds of a job are larger than 256 KiB together,
    use `kubectl apply --server-side`."""

    config_map: ConfigMapKey | None = None
    """ConfigMap key whose value is the text of a world, as for `inline`; a world with relative URLs is
    refused."""

    builtin: Builtin | None = Field(default=None, strict=False)
    """A world that ships with Palaestra. `arena`: four by four meters with four cylinders and a Robotino.
    `seeing`: the same arena with a red pole, and a Robotino with a color and a depth camera; the cylinders
    are under the floor until a task raises them. `court`: three by three meters with boxes and cylinders, and
    a TurtleBot3 Burger. `pen`: 1.2 by 0.8 meters with two cylinders, and an e-puck."""

    file: Annotated[str, Field(max_length=1024, pattern=WORLD_FILE)] | None = None
    """Absolute path of a `.wbt` file, or of a model of MuJoCo (`.xml`), in the simulator's image (`palaestra
    run`: on this machine). Put PROTOs, meshes and textures next to this file, and the rest of the Webots
    project, such as `controllers/`, next to the file's folder."""

    root: Annotated[str, Field(max_length=1024, pattern=ABSOLUTE_FOLDER)] | None = None
    """Absolute path of a folder above `file` that contains all files to which the world refers. A world that
    refers to a file outside of this folder is refused. A model of MuJoCo is also refused if a link leads
    outside of the folder. Absent: the nearest folder that contains all these files."""

    rules = (
        Rule(
            holds=lambda world: (
                world.root is None or (world.file is not None and world.file.startswith(f"{world.root}/"))
            ),
            cel='!has(self.root) || (has(self.file) && self.file.startsWith(self.root + "/"))',
            message="has a root that is not above file; set root to a folder above file, or remove it",
        ),
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
            message="needs exactly one of inline, configMap, builtin and file; set one of them",
        ),
    )


class ResetMethod(StrEnum):
    """How a simulator returns to the initial state of its world between two episodes."""

    RESET = "Reset"
    RELOAD = "Reload"
    RESTART = "Restart"


class Recycle(ApiModel):
    """When a healthy simulator is restarted between two episodes: at the first limit that it reaches."""

    after_resets: Count | None = None
    """Resets after which the simulator is restarted; 0: never; absent: resets are not counted."""

    after_minutes: Minutes | None = None
    """Minutes of use after which the simulator is restarted; absent: never."""

    above_memory: Memory | None = None
    """Memory of all processes of one simulator above which it is restarted, as `400Mi`; absent: never. Set
    it below the limit in `resources`."""

    rules = (
        Rule(
            holds=lambda recycle: any(
                limit is not None
                for limit in (recycle.after_resets, recycle.after_minutes, recycle.above_memory)
            ),
            cel="has(self.afterResets) || has(self.afterMinutes) || has(self.aboveMemory)",
            message="sets no limit; set afterResets, afterMinutes or aboveMemory",
        ),
    )


class Restart(ApiModel):
    """How many times one simulator is restarted after faults."""

    limit: Annotated[int, Field(ge=0, le=1000)] = 10
    """Number of restarts after faults within `withinSeconds`. If one more fault occurs, the replica fails
    (exit code 80). If at least `minSimulators` other simulators of the group are left, training continues
    without this simulator instead."""

    within_seconds: Seconds = 600
    """Seconds of the sliding window in which restarts are counted for `limit`."""


class SimulatorGroup(ApiModel):
    """A group of identical simulators."""

    name: GroupName
    """Name of the group, unique in the job: a DNS label of at most 20 characters."""

    role: Role = Field(strict=False)
    """`Collect`: the policy learns from the episodes. `Evaluate`: the episodes only measure the policy."""

    count: Annotated[int, Field(ge=1, le=16)] = 1
    """Number of simulators of this group in each replica."""

    min_simulators: Annotated[int, Field(ge=1, le=16)] | None = None
    """Number of simulators of this group that training needs. Training starts when that many are ready and
    the first start of each simulator has succeeded or failed. If a simulator has used up its restarts,
    training continues without it, as long as that many are left. Absent: `count`."""

    image: Image | None = None
    """Container image; absent: this release's image for the driver, or for `webots` the image that the
    installation names. `palaestra run` ignores it."""

    driver: Driver = Field(default=Driver.STUB, strict=False)
    """`stub`: Palaestra's own simulator, which simulates no masses and renders no pictures. `mujoco`: MuJoCo,
    with the same worlds, options and ROS interface as the stub. `webots`: Webots; Palaestra publishes no
    image of it, so set `image` if your cluster has no default. `command`: any program with the same ROS
    interface."""

    command: Words = ()
    """Program and arguments, for driver `command` only."""

    world: WorldSource = WorldSource(builtin=Builtin.ARENA)
    """World that the simulators load, from exactly one of four sources."""

    recycle: Recycle | None = None
    """When a healthy simulator is restarted between two episodes; absent: after 24 resets. With driver `stub`
    or `mujoco`, absent means never, because these simulators neither leak memory nor slow down."""

    reset: ResetMethod | None = Field(default=None, strict=False)
    """How each episode begins. `Reset`, or absent: the simulator resets its world. `Reload`: the
    simulator first loads the world again, which removes all state that a reset leaves. `Restart`: a new
    process of the simulator loads the world, as with `recycle: {afterResets: 1}`."""

    standby: bool = False
    """`true` runs a second simulator in the same container. The second simulator takes over at once when the
    first one is recycled or fails. The container then has twice the memory."""

    batch: Annotated[int, Field(ge=1, le=MOST_ROWS)] | None = None
    """Number of copies of the world that one simulator steps together, in one process and without ROS. This
    needs driver `mujoco`, role `Collect` and an environment with a batched form. Absent: one world, over
    ROS."""

    options: Words = ()
    """Options for the simulator's command line, one word per item."""

    restart: Restart = Restart()
    """How many times one simulator is restarted after faults."""

    start_deadline_seconds: Seconds = Field(default=60, json_schema_extra={MAY_CHANGE: True})
    """Seconds from the trainer's request to start a simulator until the trainer counts the start as failed.
    Image pulls are not counted. The operator does not end a pod because of this deadline."""

    env: Environment = ()
    """Environment variables of the simulator's container."""

    resources: Resources = Resources()
    """CPU and memory of one simulator; a standby doubles the memory. If neither the job nor the installation
    sets memory, the request is 160Mi (256Mi with driver `mujoco`) and the limit is 2Gi."""

    rules = (
        Rule(
            field="command",
            holds=lambda group: (group.driver is Driver.COMMAND) == bool(group.command),
            cel="(self.driver == 'command') == (size(self.command) > 0)",
            message="is for driver command only, and is required with that driver; set both or neither",
        ),
        Rule(
            field="image",
            holds=lambda group: group.driver is not Driver.COMMAND or group.image is not None,
            cel="self.driver != 'command' || has(self.image)",
            message="is required with driver command; name the image that contains your program",
        ),
        Rule(
            field="recycle",
            holds=lambda group: (
                group.reset is not ResetMethod.RESTART
                or group.recycle is None
                or group.recycle.after_resets in {None, 1}
            ),
            cel=(
                "!has(self.reset) || self.reset != 'Restart' || !has(self.recycle)"
                " || !has(self.recycle.afterResets) || self.recycle.afterResets == 1"
            ),
            message="contradicts reset: Restart, which restarts after each reset; remove one of them",
        ),
        Rule(
            field="minSimulators",
            holds=lambda group: group.min_simulators is None or group.min_simulators <= group.count,
            cel="!has(self.minSimulators) || self.minSimulators <= self.count",
            message="is more than count; lower it or raise count",
        ),
        Rule(
            field="batch",
            holds=lambda group: (
                group.batch is None or (group.driver is Driver.MUJOCO and group.role is Role.COLLECT)
            ),
            cel="!has(self.batch) || (self.driver == 'mujoco' && self.role == 'Collect')",
            message="needs driver mujoco and role Collect; set them, or remove batch",
        ),
        Rule(
            field="batch",
            holds=lambda group: (
                group.batch is None
                or (group.count == 1 and not group.standby and group.reset is None and group.recycle is None)
            ),
            cel=(
                "!has(self.batch) || (self.count == 1 && !self.standby && !has(self.reset)"
                " && !has(self.recycle))"
            ),
            message="cannot be combined with count, standby, reset and recycle; remove them, or remove batch",
        ),
    )
    guards = (NO_PASSWORD_IN_COMMAND, NO_PASSWORD_IN_WORDS)
