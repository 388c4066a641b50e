"""The client with roscpp: a process that reads requests and returns responses as bytes."""

import subprocess
from io import BytesIO

import roslib.message

from tests.integration.webots.genpy_messages import plain, request_of


class RoscppClient:
    """Calls services and subscribes to topics with classes of gencpp; the `with` block ends the process.

    Args:
        program: the path of the program.
        environment: the environment of the process.
        log: the file for roscpp's errors.

    Attributes:
        digests: the md5 sum of each type that the program contains.
    """

    def __init__(self, program, environment, log):
        with log.open("w") as errors:
            self._process = subprocess.Popen(
                [program],
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
            )
        self._errors = log.open()
        self._topics = {}
        self._tell("types")
        self.digests = dict(line.split() for line in self._lines())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.communicate()
        self._errors.close()

    def call(self, path, type_name, request):
        """Return the response of a service, or roscpp's error messages if the call fails."""
        service = roslib.message.get_service_class(type_name)
        self._tell("call", type_name, path, _bytes_of(request_of(service, request)).hex())
        result, _, answer = self._line().partition(" ")
        if result != "answered":
            return {"failed": self._errors.read() or "no error was logged"}
        return plain(service._response_class().deserialize(bytes.fromhex(answer)))

    def listen(self, topic, type_name):
        """Subscribe to a topic, of which the program keeps the first message."""
        self._topics[topic] = roslib.message.get_message_class(type_name)
        self._tell("listen", type_name, topic)
        self._line()

    def heard(self):
        """Return the first message of each topic that has sent one."""
        self._tell("heard")
        pairs = (line.partition(" ")[::2] for line in self._lines())
        return {topic: plain(self._topics[topic]().deserialize(bytes.fromhex(text))) for topic, text in pairs}

    def _tell(self, *words):
        self._process.stdin.write(" ".join(words) + "\n")
        self._process.stdin.flush()

    def _line(self):
        line = self._process.stdout.readline()
        assert line, "the client with roscpp has ended"
        return line.rstrip("\n")

    def _lines(self):
        return iter(self._line, "end")


def _bytes_of(message):
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
