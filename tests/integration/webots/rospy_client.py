"""A client with rospy: reads a plan as JSON from its input, and prints what comes back.

A process of its own, because rospy has one node a process.
"""

import json
import sys

import roslib.message
import rospy

from tests.integration.webots.interface_player import DEADLINE_S, plain, play, request_of


class RospyClient:
    """Calls and listens with the classes of `import webots_ros.srv`."""

    def __init__(self):
        rospy.init_node("client", anonymous=True, disable_signals=True)
        self._heard = {}

    def call(self, path, type_name, request):
        """Return the answer of a service, or the text of its failure, once it can be reached."""
        service = roslib.message.get_service_class(type_name)
        try:
            rospy.wait_for_service(path, timeout=DEADLINE_S)
            return plain(rospy.ServiceProxy(path, service)(request_of(service, request)))
        except (rospy.ServiceException, rospy.ROSException) as error:
            return {"failed": str(error)}

    def listen(self, topic, type_name):
        """Keep the first message of a topic from now on."""
        class_ = roslib.message.get_message_class(type_name)
        rospy.Subscriber(topic, class_, lambda message: self._heard.setdefault(topic, plain(message)))

    def heard(self):
        """Return the messages by topic."""
        return dict(self._heard)


answers, sys.stdout = sys.stdout, sys.stderr  # rospy prints there that it reaches a service only later
json.dump(play(json.load(sys.stdin), RospyClient()), answers)
