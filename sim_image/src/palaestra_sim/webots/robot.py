"""A robot in Webots, as the controller serves it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from palaestra_sim.ros_controller.served_robot import ServedRobot
from palaestra_sim.ros_interfaces import Service
from palaestra_sim.scene.mode import Mode
from palaestra_sim.webots.devices import devices
from palaestra_sim.webots.devices.inputs import inputs
from palaestra_sim.webots.library import Library
from palaestra_sim.webots.options import ControllerOptions
from palaestra_sim.webots.services.fields import WebotsFieldServices
from palaestra_sim.webots.services.handles import WebotsHandles
from palaestra_sim.webots.services.nodes import WebotsNodeServices
from palaestra_sim.webots.services.robot import device_list, robot_services
from palaestra_sim.webots.services.supervisor import supervisor_services
from palaestra_sim.webots.steps import WebotsSteps

_LOAD: Final = "supervisor/world_load"
_RESTART: Final = "supervisor/node/restart_controller"
# After these services, Webots ends this controller.
_ENDING: Final = frozenset(
    {"supervisor/simulation_quit", "supervisor/simulation_revert", "supervisor/world_reload", _LOAD, _RESTART}
)


@dataclass(frozen=True, slots=True, eq=False)
class WebotsTime:
    """The time of the world in Webots."""

    library: Library

    @property
    def time_ms(self) -> int:
        """The simulated time in milliseconds."""
        time_s: float = self.library.robot_get_time()
        return round(time_s * 1000.0)

    @property
    def mode(self) -> Mode:
        """Always FAST: in other modes Webots itself delays the steps."""
        return Mode.FAST


def webots_robot(
    library: Library, options: ControllerOptions, steps: WebotsSteps, later: Callable[..., None]
) -> ServedRobot:
    """Return the robot of this process.

    Args:
        library: the library of Webots, after `robot_init`.
        options: the options of the controller.
        steps: the steps of the robot.
        later: calls a function after a delay in seconds; 0 means after the response to the current call.
    """
    basic_ms = int(library.robot_get_basic_time_step())

    def await_end() -> None:
        later(0.0, lambda: steps.await_end(basic_ms))

    return ServedRobot(
        basic_step_ms=basic_ms,
        synchronized=bool(library.robot_get_synchronization()),
        clock=options.clock,
        auto_publish=options.auto_publish,
        world=WebotsTime(library),
        steps=steps,
        services=(*robot_services(library), *_supervisor(library, await_end)),
        devices=tuple(devices(library)),
        inputs=inputs(library),
        device_list=device_list(library),
    )


def _supervisor(library: Library, await_end: Callable[[], None]) -> Iterator[Service]:
    if not library.robot_get_supervisor():
        return
    handles = WebotsHandles()
    for service in (
        *supervisor_services(library, handles),
        *WebotsNodeServices(library, handles).table(),
        *WebotsFieldServices(library, handles).table(),
    ):
        yield _ending(service, library, await_end) if service.path in _ENDING else service


def _ending(service: Service, library: Library, await_end: Callable[[], None]) -> Service:
    """Return a service after which Webots ends this controller."""

    def handle(request: Any) -> Any:
        if service.path == _LOAD and not Path(request.value).is_file():
            # Webots would keep its world, and `await_end` would wait forever.
            return {"success": False}
        response = service.handler(request)
        if service.path != _RESTART or request.node == library.supervisor_node_get_self():
            await_end()
        return response

    return service._replace(handler=handle)
