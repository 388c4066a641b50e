"""The requests of our nodes to a ROS master, including masters with fewer methods than rosmaster."""

import threading
from contextlib import suppress
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from palaestra_sim.ros.master import Master, MasterUnreachable

TAKEN = [("registerService", "/a"), ("registerPublisher", "/b"), ("registerService", "/c")]


class Recording(SimpleXMLRPCServer):
    """A master that accepts registrations and refuses all other calls; `requests` counts all requests."""

    def __init__(self, *, multicall):
        super().__init__(("127.0.0.1", 0), logRequests=False)
        self.taken, self.requests = [], 0
        for method in ("registerService", "registerPublisher"):
            self.register_function(lambda _node, name, method=method: self.take(method, name), method)
        self.register_function(lambda _node: [0, "not here", 0], "getPid")
        if multicall:
            self.register_multicall_functions()

    def take(self, method, name):
        """Record a registration."""
        self.taken.append((method, name))
        return [1, "", 0]

    def _marshaled_dispatch(self, *arguments, **options):
        self.requests += 1
        return super()._marshaled_dispatch(*arguments, **options)


@pytest.fixture(params=[True, False], ids=["multicall", "without multicall"])
def recording(request):
    """Yield a master with `system.multicall`, and then one without."""
    with Recording(multicall=request.param) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def master(recording):
    """Yield our client of the recording master."""
    made = Master(f"http://127.0.0.1:{recording.server_address[1]}", "/robot")
    yield made
    made.close()


def test_registrations_of_a_block_are_sent_in_order_and_in_one_request_if_the_master_can(recording, master):
    """Clients that find the last service of a robot assume that all earlier ones exist."""
    with master.together():
        for method, name in TAKEN:
            master.tell(method, name)

        assert recording.taken == []
    assert recording.taken == TAKEN
    assert recording.requests in {1, 1 + len(TAKEN)}


def test_a_refusal_among_several_calls_is_an_error(master):
    """A caller must get the same error for a refused call in a block as for a single call."""
    block = master.together()
    block.__enter__()
    master.tell("registerService", "/a")
    master.tell("getPid")

    with pytest.raises(MasterUnreachable, match="refused getPid: not here"):
        block.__exit__(None, None, None)


def test_a_block_that_fails_registers_nothing(recording, master):
    """Clients must not find a simulator whose start has failed."""
    with suppress(ZeroDivisionError), master.together():
        master.tell("registerService", "/a")
        raise ZeroDivisionError

    assert recording.requests == 0
    master.tell("registerService", "/later")
    assert recording.taken == [("registerService", "/later")]
