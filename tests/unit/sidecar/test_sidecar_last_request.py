"""A sidecar whose client was killed without closing a connection ends by itself."""

from http import HTTPStatus

from palaestra_protocol.http import Response
from palaestra_sim.sidecar.last_request import LastRequest


def _respond(body):
    return Response(status=HTTPStatus.OK, body=body, content_type="text/plain")


def test_silence_is_counted_from_the_last_request():
    """A client that asks in time keeps the sidecar alive; the time before its last request does not count."""
    now, waited = [0.0], []

    def sleep(seconds):
        waited.append(seconds)
        if len(waited) == 1:  # the client asks shortly before the limit
            now[0] += seconds - 3.0
            assert routes["GET", "/state"](b"same").body == b"same"
            now[0] += 3.0
        else:
            now[0] += seconds

    requests = LastRequest(clock=lambda: now[0], sleep=sleep)
    routes = requests.noted({("GET", "/state"): _respond})
    requests.wait_for_silence(10.0)

    assert waited == [10.0, 7.0]
    assert now[0] == 17.0
