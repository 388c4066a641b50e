"""A client with rospy: calls the services and listens to the topics of a plan, and prints what comes back.

Reads one JSON object from its input: `calls`, a list of [name, path, type, request]; `topics`, type by path;
`rounds`, a list of [path, type, request] that make topics speak; `last`, calls that end what runs.
A string "@name" in a request is the first value of the answer to that call, such as the handle of a node.
"""

import json
import sys
import time

import genpy
import roslib.message
import rospy

DEADLINE_S = 20.0


def plain(value):
    """Return a message, or what is in one, as JSON has it."""
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, genpy.Time | genpy.Duration):
        return value.to_sec()
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def call(path, type_name, request):
    """Return the answer of a service, or the text of its failure, once it can be reached."""
    class_ = roslib.message.get_service_class(type_name)
    message = class_._request_class()
    genpy.message.fill_message_args(message, [request])
    end = time.monotonic() + DEADLINE_S
    while True:
        try:
            rospy.wait_for_service(path, timeout=DEADLINE_S)
            return plain(rospy.ServiceProxy(path, class_)(message))
        except rospy.ServiceException as error:
            # A controller that restarts takes its services back for a moment.
            if "responded with an error" in str(error) or time.monotonic() > end:
                return {"failed": str(error)}
        rospy.sleep(0.02)


def filled(request, answers):
    """Return a request with the answers that it refers to."""
    return {
        name: next(iter(answers[value[1:]].values())) if str(value).startswith("@") else value
        for name, value in request.items()
    }


def listen(topics, rounds):
    """Return the first message of every topic; those that stay silent are missing."""
    heard = {}
    for path, type_name in topics.items():
        class_ = roslib.message.get_message_class(type_name)
        rospy.Subscriber(path, class_, lambda message, path=path: heard.setdefault(path, plain(message)))
    end = time.monotonic() + DEADLINE_S
    while topics.keys() - heard.keys() and time.monotonic() < end:
        for path, type_name, request in rounds:
            call(path, type_name, request)
    return heard


def main():
    """Carry the plan out."""
    plan = json.load(sys.stdin)
    rospy.init_node("client", anonymous=True, disable_signals=True)
    answers = {}
    for name, path, type_name, request in plan["calls"]:
        answers[name] = call(path, type_name, filled(request, answers))
    heard = listen(plan["topics"], plan["rounds"])
    for name, path, type_name, request in plan["last"]:
        answers[name] = call(path, type_name, filled(request, answers))
    json.dump({"answers": answers, "heard": heard}, sys.stdout)


main()
