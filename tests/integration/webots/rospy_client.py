"""The client with rospy: `python -m tests.integration.webots.rospy_client SIMULATOR FILES` prints results.

It is a separate process, because rospy can have only one node per process.
"""

import json
import sys

import roslib.message
import rospy

from palaestra_trainer.ros.conformance.claims import claims
from palaestra_trainer.ros.conformance.player import DEADLINE_S
from tests.integration.webots.genpy_messages import plain, request_of
from tests.integration.webots.playing import play


class RospyClient:
    """Calls services and subscribes to topics with the classes of the package webots_ros."""

    def __init__(self):
        rospy.init_node("client", anonymous=True, disable_signals=True)
        self._heard = {}

    def call(self, path, type_name, request):
        """Wait for a service and return its response, or the error message if the call fails."""
        service = roslib.message.get_service_class(type_name)
        try:
            rospy.wait_for_service(path, timeout=DEADLINE_S)
            return plain(rospy.ServiceProxy(path, service)(request_of(service, request)))
        except (rospy.ServiceException, rospy.ROSException) as error:
            return {"failed": str(error)}

    def listen(self, topic, type_name):
        """Subscribe to a topic and keep its first message."""
        class_ = roslib.message.get_message_class(type_name)
        rospy.Subscriber(topic, class_, lambda message: self._heard.setdefault(topic, plain(message)))

    def heard(self):
        """Return the first message of each topic that has sent one."""
        return dict(self._heard)


answers, sys.stdout = sys.stdout, sys.stderr  # rospy prints to stdout when it waits for a service
json.dump(play(claims(sys.argv[1]), RospyClient(), sys.argv[2]), answers)
