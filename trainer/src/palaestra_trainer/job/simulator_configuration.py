"""The sections of training.yaml about one simulator."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from palaestra_protocol.batch import MOST_ROWS
from palaestra_protocol.pod.enums import Role
from palaestra_trainer.job.section import ConfigurationSection, Positive


class Recycle(ConfigurationSection):
    """Limits for a healthy simulator; when it reaches a limit, it is restarted after its current episode.

    Attributes:
        after_resets: greatest number of resets since the simulator was started, or took over as a standby.
        after_minutes: greatest number of minutes since the simulator was started or took over; its time as a
            standby does not count.
        above_memory_bytes: greatest memory of all processes of the simulator together.
    """

    after_resets: Positive | None = None
    after_minutes: Annotated[float, Field(gt=0)] | None = None
    above_memory_bytes: Positive | None = None


class Restart(ConfigurationSection):
    """The restart budget of one simulator: at most `limit` restarts within any `within_seconds`."""

    limit: Annotated[int, Field(ge=0)] = 10
    within_seconds: Annotated[float, Field(gt=0)] = 600


class SimulatorConfiguration(ConfigurationSection):
    """One simulator of this replica.

    Attributes:
        name: `<group>-<index>`, unique in the file.
        role: `Collect` for collecting experience, `Evaluate` for evaluating the policy.
        min_simulators: number of simulators of its group that must work for the run to continue; None: all.
        control: address of the control port of the simulator's sidecar.
        driver: the simulator program, `stub`, `mujoco`, `webots` or `command`.
        options: command-line options of the simulator program.
        world: path of the generated world that the simulator loads.
        reset: `Reload`: the simulator loads its world again before each episode but the first; None: it only
            resets its world.
        standby: whether the sidecar also runs a standby for this simulator.
        batch: number of copies of the world that the simulator steps together; None: one, over ROS.
        start_deadline_seconds: seconds within which the simulator must respond after its start.
    """

    name: str
    group: str
    index: Annotated[int, Field(ge=0)]
    role: Role
    min_simulators: Positive | None = None
    control: str = ""
    driver: str = "stub"
    options: tuple[str, ...] = ()
    world: str = ""
    recycle: Recycle | None = None
    reset: Literal["Reload"] | None = None
    standby: bool = False
    batch: Annotated[int, Field(ge=1, le=MOST_ROWS)] | None = None
    restart: Restart = Field(default_factory=Restart)
    start_deadline_seconds: Annotated[float, Field(gt=0)] = 60
