"""Execute a plan of the interface with a client of any library.

A plan has four entries:

- `calls`: a list of [name, path, type, request]
- `topics`: a type by path
- `rounds`: a list of [path, type, request] that cause messages on topics
- `last`: calls that end the simulator

In a request, the string "@name" stands for the first value in the response to that call, e.g. the handle of a
node.

A client has three functions. `call(path, type, request)` returns the response as a dictionary, or {"failed":
text}. `listen(topic, type)` subscribes. `heard()` returns the first message of each topic.
"""

import time

import genpy
import genpy.message

DEADLINE_S = 20.0
PAUSE_S = 0.02


def play(plan, client):
    """Return the responses (`answers`) by name of the call, and the messages (`heard`) by topic."""
    answers = {}
    for name, path, type_name, request in plan["calls"]:
        answers[name] = client.call(path, type_name, _filled(request, answers))
    for topic, type_name in plan["topics"].items():
        client.listen(topic, type_name)
    heard = _heard(plan, client)
    for name, path, type_name, request in plan["last"]:
        answers[name] = _call_again(client, path, type_name, _filled(request, answers))
    return {"answers": answers, "heard": heard}


def request_of(service, fields):
    """Return a request of a genpy class with these fields; the other fields have their defaults."""
    message = service._request_class()
    genpy.message.fill_message_args(message, [fields])
    return message


def plain(value):
    """Return a message, or a value inside one, as JSON data."""
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, genpy.Time | genpy.Duration):
        return value.to_sec()
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _filled(request, answers):
    """Return a request in which values of earlier responses replace "@name"."""
    return {
        name: next(iter(answers[value[1:]].values())) if str(value).startswith("@") else value
        for name, value in request.items()
    }


def _heard(plan, client):
    """Call the rounds until every topic has sent a message or the time is over; return the messages."""
    end = time.monotonic() + DEADLINE_S
    heard = {}
    while plan["topics"].keys() - heard.keys() and time.monotonic() < end:
        for path, type_name, request in plan["rounds"]:
            client.call(path, type_name, request)
        heard = client.heard()
    return heard


def _call_again(client, path, type_name, request):
    """Call a service until it responds.

    A controller that restarts has no services for a moment.
    """
    end = time.monotonic() + DEADLINE_S
    while True:
        answer = client.call(path, type_name, request)
        if "failed" not in answer or time.monotonic() > end:
            return answer
        time.sleep(PAUSE_S)
