"""A step of move-to-target by a client that only moves bytes. No client in Python can be faster.

The client connects as any ROS client does. In each step it sends the same requests as Palaestra's client, in
the same order. It packs their bytes before the measurement, reads whole frames, and decodes nothing.
"""

import contextlib
import itertools
import os
import socket
import struct

from palaestra_protocol.ros import sockets
from palaestra_protocol.ros.rostypes import message_type, service_type
from palaestra_protocol.ros.tcpros import LENGTH, decode_header, encode_header
from palaestra_protocol.ros.topic_headers import subscriber_header
from palaestra_protocol.xmlrpc import client
from palaestra_protocol.xmlrpc.responses import address_of, response_of
from palaestra_trainer.ros.master import Master

NAME = "raw_client"
PERIOD_MS = 192
DEADLINE_S = 5.0
LOOKS = 30  # the number of polls before the client waits in the kernel, as in Palaestra's client
RADIUS_M, DISTANCE_M = 0.063, 0.1826
RANGES = tuple(f"ir{number}" for number in range(1, 10))
TURNS_RAD_S = (1.0, -1.0)


class RawClient:
    """The connections of one robot, and the bytes of its requests.

    Args:
        robot: the ROS name of the robot, whose sensors are enabled and whose motors are released.
    """

    def __init__(self, robot):
        self._robot = robot
        self._master = Master(f"/{NAME}")
        self._open = contextlib.ExitStack()
        wheels = [self._service(f"wheel{number}_joint/set_velocity", "set_float") for number in range(3)]
        self._commands = itertools.cycle(
            [
                [(wheel, framed("set_float", value=-turn * DISTANCE_M / RADIUS_M)) for wheel in wheels]
                for turn in TURNS_RAD_S
            ]
        )
        self._time_step = self._service("robot/time_step", "set_int")
        self._period = framed("set_int", value=PERIOD_MS)
        self._topics = [
            *(self._topic(f"{name}/value", "sensor_msgs/Range") for name in RANGES),
            self._topic("touch_sensor/value", "webots_ros/BoolStamped"),
        ]
        self._pose = [
            self._service(f"supervisor/node/{name}", f"node_{name}")
            for name in ("get_position", "get_orientation")
        ]
        self._node = framed("node_get_position", node=self._handle())

    def step(self):
        """Take one step: three wheel commands, one time_step, ten messages of sensors and the pose."""
        commands = next(self._commands)
        for wheel, data in commands:
            wheel.send(data)
        for wheel, _ in commands:
            received(wheel)
        self._time_step.send(self._period)
        received(self._time_step)
        for service in self._pose:
            service.send(self._node)
        for topic in self._topics:
            received(topic)
        for service in self._pose:
            received(service)

    def close(self):
        """Close all connections."""
        self._open.close()

    def _service(self, path, type_name):
        type_ = service_type(f"webots_ros/{type_name}")
        name = f"/{self._robot}/{path}"
        header = {"callerid": f"/{NAME}", "md5sum": type_.md5, "persistent": "1", "service": name}
        return self._connected(self._master.service_address(name), header)

    def _topic(self, path, type_name):
        """Subscribe without a registration at the master, because the publisher's address is known."""
        name = f"/{self._robot}/{path}"
        node = client.call(self._master.uri, DEADLINE_S, "lookupNode", f"/{NAME}", f"/{self._robot}")
        publisher = response_of(node).value
        answer = client.call(publisher, DEADLINE_S, "requestTopic", f"/{NAME}", name, [["TCPROS"]])
        header = subscriber_header(f"/{NAME}", name, message_type(type_name))
        topic = self._connected(address_of(response_of(answer)), header)
        topic.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 0)
        return topic

    def _connected(self, address, header):
        connection = self._open.enter_context(socket.create_connection(address, timeout=DEADLINE_S))
        connection.settimeout(None)
        for option in sockets.OPTIONS:
            connection.setsockopt(*option)
        connection.sendall(encode_header(header))
        (length,) = LENGTH.unpack(connection.recv(LENGTH.size, socket.MSG_WAITALL))
        words = decode_header(connection.recv(length, socket.MSG_WAITALL))
        if "error" in words:
            raise RuntimeError(words["error"])
        return connection

    def _handle(self):
        """Return the handle of the robot's node."""
        service = self._service("supervisor/get_from_def", "supervisor_get_from_def")
        service.sendall(framed("supervisor_get_from_def", name="ROBOTINO"))
        (node,) = struct.unpack_from("<Q", received(service), 1 + LENGTH.size)
        return node


def framed(type_name, **fields):
    """Return the bytes of a request."""
    return service_type(f"webots_ros/{type_name}").request.frame(fields)


def received(connection):
    """Return the frame that arrives next; it is smaller than one packet, so it arrives in one piece."""
    for _ in range(LOOKS):
        try:
            return connection.recv(sockets.FIRST_BYTES, socket.MSG_DONTWAIT)
        except BlockingIOError:
            os.sched_yield()
    return connection.recv(sockets.FIRST_BYTES)
