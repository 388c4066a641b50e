"""The client with roscpp as a process, which reads requests and returns responses as bytes."""

import subprocess
from io import BytesIO

import roslib.message

from tests.integration.webots.interface_player import plain, request_of


class RoscppClient:
    """Calls and listens with the classes from gencpp; it is a context, which ends the process.

    Args:
        program: its path.
        environment: of its process.
        log: the file for the errors that roscpp logs.

    Attributes:
        digests: the md5 of each type, in the program.
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
        """Return the response of a service once it can be reached, or roscpp's log of the failure."""
        service = roslib.message.get_service_class(type_name)
        self._tell("call", type_name, path, _bytes_of(request_of(service, request)).hex())
        result, _, answer = self._line().partition(" ")
        if result != "answered":
            return {"failed": self._errors.read() or "no error was logged"}
        return plain(service._response_class().deserialize(bytes.fromhex(answer)))

    def listen(self, topic, type_name):
        """Keep the first message of a topic from now on."""
        self._topics[topic] = roslib.message.get_message_class(type_name)
        self._tell("listen", type_name, topic)
        self._line()

    def heard(self):
        """Return the messages by topic."""
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
