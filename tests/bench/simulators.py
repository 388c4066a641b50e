"""The stub and MuJoCo compared: start, steps, images and memory.

Every second step renders an image, so one client measures steps with and without images in turns.
"""

import contextlib
import itertools
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from palaestra_sim.world import builtin
from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.ros import RosService, RosSubscriber
from palaestra_trainer.webots.launching.master import ensure_master
from tests.bench.sizes import scaled

RUN = "import sys; from palaestra_sim.{}.cli import main; sys.exit(main())"
SIMULATORS = ("stub", "mujoco")
SIZES = ((64, 48), (160, 120), (640, 480))
BOXES = 200
STEP_MS = 192
STEPS = 300
ROBOT = "robotino"
DEADLINE_S = 30.0
CAMERA = 'Camera {{ translation 0.1 0 0.25 name "eye" width {} height {} fieldOfView 1.2 }}'


def measure(scale=1.0):
    """Return the figures of each simulator: times in ms, and memory in MiB."""
    ensure_master()
    steps, boxes = scaled(STEPS, scale), scaled(BOXES, scale)
    found = {simulator: plain(simulator, steps) for simulator in SIMULATORS}
    for width, height in SIZES[: scaled(len(SIZES), scale)]:
        found["mujoco"][f"{width}x{height}"] = pictures(width, height, steps)
    found["mujoco"][f"{boxes}_boxes"] = beside_boxes(boxes, steps)
    return found


def plain(simulator, steps):
    """Return the time of a start, the time of a step, and the memory, in the built-in arena."""
    with running(simulator, builtin("arena").decode()) as (process, start_s):
        with stepping() as step:
            spent = [step() for _ in range(steps)]
        return {"start_ms": ms(start_s), "step_ms": ms(statistics.median(spent)), "rss_mib": memory(process)}


def pictures(width, height, steps):
    """Return the times of steps without an image, and of steps until their image has arrived."""
    world = re.sub(
        r"(DEF ROBOTINO Robot \{.*?children \[)",
        lambda found: f"{found[1]} {CAMERA.format(width, height)}",
        builtin("arena").decode(),
        count=1,
        flags=re.DOTALL,
    )
    with running("mujoco", world) as (process, _), stepping() as step:
        call("eye/enable", "set_int", value=2 * STEP_MS)
        eye = RosSubscriber(f"/{ROBOT}/eye/image", "sensor_msgs/Image", decode=len)
        eye.connect()
        spent, worked = {0: [], 1: []}, {0: [], 1: []}
        for number in range(1, 2 * steps + 1):
            began, worked_before = time.perf_counter(), processor_s(process)
            step()
            if number % 2 == 0:
                eye.next()
            spent[number % 2].append(time.perf_counter() - began)
            worked[number % 2].append(processor_s(process) - worked_before)
        eye.close()
        without, with_one = (statistics.median(spent[rest]) for rest in (1, 0))
        return {
            "step_ms": ms(without),
            "step_with_picture_ms": ms(with_one),
            "picture_ms": ms(with_one - without),
            "picture_processor_ms": ms(statistics.median(worked[0]) - statistics.median(worked[1])),
            "rss_mib": memory(process),
        }


def beside_boxes(count, steps):
    """Return the time of a step, and the memory, in a world with many crates."""
    places = itertools.islice(itertools.product(range(20), range(20)), count)
    crates = "\n".join(
        f'Solid {{ translation {3 + x} {y} 0.1 name "{x} {y}" physics Physics {{ density -1 mass 1 }}'
        " boundingObject Box { size 0.2 0.2 0.2 } }"
        for x, y in places
    )
    world = builtin("arena").decode()
    with running("mujoco", f"{world}\n{crates}\n") as (process, _), stepping() as step:
        spent = [step() for _ in range(steps)]
        return {"step_ms": ms(statistics.median(spent)), "rss_mib": memory(process)}


@contextlib.contextmanager
def running(simulator, world):
    """Run a simulator; yield its process and the seconds until its first response."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "bench.wbt")
        path.write_text(world)
        began = time.perf_counter()
        command = [sys.executable, "-c", RUN.format(simulator), path]
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
            try:
                wait_for_answer()
                yield process, time.perf_counter() - began
            finally:
                process.terminate()


def wait_for_answer():
    """Wait until the simulator responds."""
    end = time.monotonic() + DEADLINE_S
    while True:
        try:
            call("robot/get_device_list", "robot_get_device_list")
        except SimulatorFault:
            if time.monotonic() > end:
                raise
            time.sleep(0.01)  # the service is not registered yet
        else:
            return


def call(path, type_name, **fields):
    """Call a service once, and return the response."""
    service = RosService(f"/{ROBOT}/{path}", f"webots_ros/{type_name}", DEADLINE_S)
    try:
        return service(**fields)
    finally:
        service.close()


@contextlib.contextmanager
def stepping():
    """Yield a function that steps once and returns the step's duration in seconds."""
    time_step = RosService(f"/{ROBOT}/robot/time_step", "webots_ros/set_int")

    def step():
        began = time.perf_counter()
        time_step(value=STEP_MS)
        return time.perf_counter() - began

    try:
        yield step
    finally:
        time_step.close()


def processor_s(process):
    """Return the processor time of a process, which other programs hardly affect."""
    return int(Path(f"/proc/{process.pid}/schedstat").read_text().split()[0]) / 1e9


def memory(process):
    """Return the resident memory of a process in MiB."""
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return round(pages * os.sysconf("SC_PAGE_SIZE") / 2**20)


def ms(seconds):
    """Return seconds in ms."""
    return round(1000.0 * seconds, 2)
