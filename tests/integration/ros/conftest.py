"""A ROS node of the stub's kind, in a thread, with a real ROS master."""

import threading

import pytest

from palaestra_sim.ros import LATER, Loop, RosNode, ServiceFailed

DEADLINE_S = 60.0  # the waits take milliseconds on an idle machine


class Peer:
    """A node in a separate thread, with services that respond, fail, or never respond."""

    def __init__(self, name, master_uri):
        self.name = name
        self.loop = Loop()
        self.node = RosNode(self.loop, name, master_uri)
        self.asked = []
        self.node.serve("double", "webots_ros/set_float", self._double)
        self.node.serve("get_time", "webots_ros/get_float", lambda _: {"value": 1.25})
        self.node.serve("fail", "webots_ros/get_float", self._fail)
        self.node.serve("never", "webots_ros/get_float", lambda _: LATER)
        self.publisher = self.node.advertise("ir1/value", "sensor_msgs/Range")
        self.thread = threading.Thread(target=self.loop.run, daemon=True)
        self.thread.start()

    def _double(self, request):
        self.asked.append(request.value)
        return {"success": request.value > 0}

    def _fail(self, _request):
        raise ServiceFailed("the handle is 0")

    def do(self, action):
        """Run `action` in the node's thread, and wait for its end."""
        done = threading.Event()
        self.loop.post(lambda: (action(), done.set()))
        assert done.wait(DEADLINE_S)

    def end(self, last=None):
        """Run `last`, which by default closes the node properly, and end the thread."""
        if self.thread.is_alive():
            self.do(last or self.node.close)
            self.loop.post(self.loop.stop)
            self.thread.join(DEADLINE_S)
            self.loop.close()


@pytest.fixture
def peer(master, request):
    """Yield a new node whose name comes from the name of the test."""
    node = Peer(request.node.name[:50].rstrip("_"), master)
    yield node
    node.end()
