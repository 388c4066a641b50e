"""The command `webots` of the tests: the world, the controllers' processes, and their steps."""

import argparse
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
from functools import partial
from importlib import import_module
from pathlib import Path

from palaestra_sim.ros.loop import Loop
from palaestra_sim.ros_controller.handles import Handles
from palaestra_sim.ros_controller.scene_robot import served
from palaestra_sim.scene.arguments import ControllerArguments
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.stepping import Stepping
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.stub.physics import StubPhysics
from tests.fake_webots.answers import Answers
from tests.fake_webots.wire import read_request, write_result

GRACE_S = 1.0  # as in Webots, the time that a controller has to end before it gets SIGTERM
MODES = {"pause": Mode.PAUSE, "realtime": Mode.REAL_TIME, "fast": Mode.FAST}
QUIT = -1
_POLL_S = 0.02  # interval between two checks whether the controllers' processes still run


def main():
    """Run the world until a controller quits the simulation, or until SIGTERM; return the exit code."""
    add = (parser := argparse.ArgumentParser(prog="webots")).add_argument
    for flag in ("--batch", "--stdout", "--stderr", "--minimize", "--no-rendering"):
        add(flag, action="store_true")
    add("--mode", choices=MODES, default="realtime")
    add("--port", type=int, default=1234)
    add("--stream", nargs="?", const="")
    add("world", type=Path)
    return Webots(parser.parse_args()).run()


class Webots:
    """A running Webots, which the services of the stub use as their host."""

    def __init__(self, options):
        self.options = options
        self.world_path = options.world.absolute()
        self.loop = Loop()
        self.home = Path(os.environ["WEBOTS_HOME"])
        self.folder = tempfile.mkdtemp(prefix="fake-webots-")
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(f"{self.folder}/socket")
        self.listener.listen()
        self.listener.setblocking(False)
        self.loop.watch(self.listener, self.accept)
        self.controllers = {}
        self.code = 0
        self.then = None  # while all controllers are being ended, the function that is called afterwards
        self.mode = MODES[options.mode]

    def run(self):
        """Load the world, start the controllers, and serve them until the end."""
        self.loop.wake_on_signals()
        signal.signal(signal.SIGTERM, lambda *_: self.loop.post(self.end_program))
        try:
            self.load_world()
            self.loop.run()
        finally:
            for controller in self.controllers.values():
                controller.kill()
            shutil.rmtree(self.folder)
        return self.code

    def load_world(self):
        """Load the world file, and start the controller of each robot, in the order of the file."""
        self.then = None
        load = Loader(physics=_physics(), leave_out=LeaveOut(names=True))
        self.simulation = load(self.world_path, self.mode)
        self.stepping = Stepping(self.simulation)
        self.handles = Handles(self.simulation)
        self.controllers = {}
        for robot in self.simulation.robots:
            self.start(robot)

    def start(self, robot):
        """Start the controller of a robot."""
        answers = Answers(robot, served(self, self.stepping, self.handles, robot))
        controller = Controller(self, robot, answers)
        self.controllers[robot.name] = controller
        controller.begin()

    def accept(self):
        """Connect a controller, whose first request names its robot."""
        connection, _ = self.listener.accept()
        Link(self, connection)

    def end_program(self):
        """End all controllers and then the program, even if a load of a world has begun."""
        if self.then is not None:
            self.then = self.loop.stop
            return
        self.end(self.loop.stop)

    def end(self, then):
        """End all controllers, and then call `then`; do nothing if they are being ended already."""
        if self.then is not None:
            return
        self.then = then
        self.stepping.end()
        self.end_controllers(list(self.controllers.values()), self.go_on)

    def go_on(self):
        """Call the current `then`, which `end_program` may have replaced in the meantime."""
        self.then()

    def end_controllers(self, controllers, then):
        """End controllers, and then call `then`.

        The next step of a controller returns -1. A controller that still runs after a second gets SIGTERM.
        """
        for controller in controllers:
            controller.leaving = True
        self.await_ends(controllers, then, 0.0)

    def await_ends(self, controllers, then, waited_s):
        """Call `then` as soon as all these controllers have ended."""
        running = [it for it in controllers if it.runs]
        if not running:
            then()
            return
        if waited_s >= GRACE_S:
            for controller in running:
                controller.process.terminate()
        self.loop.later(_POLL_S, lambda: self.await_ends(controllers, then, waited_s + _POLL_S))

    # The services of the stub call the following methods.

    def arguments(self, robot):
        """Return arguments that affect only our own simulators."""
        del robot
        return ControllerArguments(name="unused")

    def set_mode(self, mode):
        """Set the mode, and run the steps that waited for the end of a pause."""
        self.mode = self.simulation.mode = mode
        self.loop.later(0.0, self.stepping.advance)

    def quit(self, status):
        """End the program with this exit code."""
        self.code = status
        self.loop.later(0.0, self.end_program)

    def reload(self):
        """Load the world file again."""
        self.load(str(self.world_path))

    def load(self, path):
        """Load another world."""
        self.world_path = Path(path).absolute()
        self.loop.later(0.0, lambda: self.end(self.load_world))
        return True

    def restart(self, robot):
        """Restart the controller of a robot."""
        self.end_controllers([self.controllers[robot.name]], lambda: self.start_again(robot))

    def start_again(self, robot):
        """Start the controller of a robot again, unless all controllers are being ended."""
        if self.then is not None:
            return
        self.stepping.leave(robot)
        self.start(robot)


class Controller:
    """The controller of one robot: its process, and the functions of its library."""

    def __init__(self, webots, robot, answers):
        self.webots = webots
        self.robot = robot
        self.answers = answers
        self.process = None
        self.leaving = False

    @property
    def runs(self):
        """Return whether the process runs."""
        return self.process is not None and self.process.poll() is None

    def begin(self):
        """Start the process as Webots does; without a controller, print a warning."""
        node = self.robot.parts.node
        name = node.text("controller") or "<generic>"
        found = self.find(name)
        if found is None:
            sys.stderr.write(f"WARNING: {self.robot.name}: The controller {name!r} was not found.\n")
            return
        if self.robot.parts.node.flag("synchronization", True):
            self.webots.stepping.join(self.robot)
        python = found.suffix == ".py"
        command = [interpreter(found), found.name] if python else [str(found)]
        options = self.webots.options
        self.process = subprocess.Popen(
            [*command, *node.texts("controllerArgs")],
            cwd=found.parent,
            env=self.environment(),
            stdout=None if options.stdout else subprocess.DEVNULL,
            stderr=None if options.stderr else subprocess.DEVNULL,
        )
        self.watch()

    def find(self, name):
        """Return the file of a controller, from the first folder that exists."""
        projects = [self.webots.world_path.parent.parent]
        projects += map(Path, filter(None, os.environ.get("WEBOTS_EXTRA_PROJECT_PATH", "").split(":")))
        projects.append(self.webots.home / "projects" / "default")
        folder = next((it for p in projects if (it := p / "controllers" / name).is_dir()), None)
        files = [] if folder is None else [folder / name, folder / f"{name}.py"]
        return next((file for file in files if file.is_file()), None)

    def environment(self):
        """Return the environment variables of the process."""
        library = self.webots.home / "lib" / "controller"
        return {
            **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
            "WEBOTS_ROBOT_NAME": self.robot.name,
            "WEBOTS_INSTANCE_PATH": self.webots.folder,
            "FAKE_WEBOTS": f"{self.webots.folder}/socket",
            "PYTHONIOENCODING": "UTF-8",
            "LD_LIBRARY_PATH": str(library),
            "PYTHONPATH": f"{library}/python",
        }

    def watch(self):
        """Wait for the end of the process; afterwards, the world steps without this controller."""
        if self.runs:
            self.webots.loop.later(_POLL_S, self.watch)
            return
        if not self.leaving:
            code = self.process.returncode
            sys.stderr.write(f"WARNING: {self.robot.name!r} controller exited with status: {code}.\n")
            self.webots.stepping.leave(self.robot)

    def kill(self):
        """End the process at once."""
        self.leaving = True
        if self.runs:
            self.process.kill()
            self.process.wait()


def _physics():
    """Return the physics of the world: the stub's, or MuJoCo's, which draws pictures."""
    if os.environ.get("FAKE_WEBOTS_PHYSICS") == "mujoco":
        return import_module("palaestra_sim.mujoco.physics").MujocoPhysics
    return StubPhysics


def interpreter(script):
    """Return the interpreter in the first line of a script, or `python`."""
    first = script.read_text().partition("\n")[0]
    return first.removeprefix("#!").strip() if first.startswith("#!") else "python"


class Link:
    """The connection of one controller."""

    def __init__(self, webots, connection):
        self.webots = webots
        self.connection = connection
        self.controller = None
        self.data = b""
        webots.loop.watch(connection, self.read)

    def read(self):
        """Answer the requests that have arrived whole."""
        try:
            data = self.connection.recv(65536)
        except ConnectionError:
            data = b""
        if not data:
            self.webots.loop.forget(self.connection)
            self.connection.close()
            return
        self.data += data
        while len(self.data) >= 4:
            (size,) = struct.unpack_from("<I", self.data)
            if len(self.data) < 4 + size:
                return
            request, self.data = self.data[4 : 4 + size], self.data[4 + size :]
            self.handle(*read_request(request))

    def handle(self, name, arguments):
        """Answer one request, or let a step wait."""
        if name == "robot_init":
            self.controller = self.webots.controllers[arguments[0].decode()]
            self.send(name, 1)
        elif name == "robot_step":
            self.step(*arguments)
        else:
            self.send(name, self.controller.answers.call(name, arguments))

    def step(self, duration_ms):
        """Simulate a step as soon as all other controllers have requested one."""
        if self.controller.leaving:
            self.send("robot_step", QUIT)
            return
        self.webots.stepping.ask(self.controller.robot, duration_ms, partial(self.stepped))

    def stepped(self, done):
        """Respond to a step."""
        if done:
            self.controller.answers.begin_step()
        self.send("robot_step", 0 if done else QUIT)

    def send(self, name, value):
        """Send the result of a function."""
        result = write_result(name, value)
        self.connection.sendall(struct.pack("<I", len(result)) + result)


if __name__ == "__main__":
    sys.exit(main())
