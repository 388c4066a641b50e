"""A client with rospy: it reads a plan as JSON from its input, and prints the results.

It is a separate process, because rospy has one node per process.
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
        """Return the response of a service once it can be reached, or the text of its failure."""
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


answers, sys.stdout = sys.stdout, sys.stderr  # rospy prints to stdout when it reaches a service only later
json.dump(play(json.load(sys.stdin), RospyClient()), answers)
