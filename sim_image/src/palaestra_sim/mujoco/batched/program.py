"""Run `palaestra-mujoco --batch N`: load the world, and serve its copies until a signal."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from palaestra_protocol.control import BATCH_FILE
from palaestra_sim.mujoco.batched.model_batch import ModelBatch
from palaestra_sim.mujoco.batched.scene_batch import SceneBatch
from palaestra_sim.mujoco.batched.server import BatchServer
from palaestra_sim.mujoco.batched.world import BatchWorld
from palaestra_sim.mujoco.mjcf.simulation import MjcfSimulation
from palaestra_sim.ros_controller.backend import Backend
from palaestra_sim.scene.simulation import Simulation


def serve(simulation: Backend, world: Path, rows: int, threads: int) -> int:
    """Serve `rows` copies of a world until SIGTERM or SIGINT; return the exit code.

    Raises:
        BatchRefusedError: the world has parts that the batch form does not simulate.
        OSError: the file of the address cannot be written.
    """
    file = os.environ.get(BATCH_FILE)
    threads = threads or len(os.sched_getaffinity(0))
    batch = batch_of(simulation, world.name, rows, threads)
    server = BatchServer(batch, rows, None if file is None else Path(file))
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: server.stop())
    server.run()
    return 0


def batch_of(simulation: Backend, name: str, rows: int, threads: int) -> BatchWorld:
    """Return copies of a world; `BatchWorld.open` comes before the first step.

    Raises:
        BatchRefusedError: the world has parts that the batch form does not simulate.
    """
    if isinstance(simulation, MjcfSimulation):
        return ModelBatch(simulation, name, rows, threads)
    if isinstance(simulation, Simulation):
        return SceneBatch(simulation, name, rows, threads)
    raise TypeError(f"{type(simulation).__name__} is not a simulation of MuJoCo")
