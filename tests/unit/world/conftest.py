"""Small worlds, the identity of one simulator, and the message with which a world is refused."""

from collections.abc import Callable

import pytest

from palaestra_sim.world import RunIdentity, WorldError, generate

HEADER = b"#VRML_SIM R2023b utf8\n"


@pytest.fixture
def world() -> Callable[[str], bytes]:
    """Return a function that puts the header of a world before a text."""
    return lambda text: HEADER + text.encode()


@pytest.fixture
def identity() -> RunIdentity:
    """Return the identity of the second collecting simulator of a job's first replica."""
    return RunIdentity(job="move-to-target", uid="6f1c", replica=0, group="collect", index=1)


@pytest.fixture
def refusal(world: Callable[[str], bytes], identity: RunIdentity) -> Callable[..., str]:
    """Return a function that returns the error message for the text of a world."""

    def tell(text: str, *, relative_addresses: bool = False) -> str:
        with pytest.raises(WorldError) as caught:
            generate(
                world(text),
                identity,
                clock=True,
                name="my.wbt",
                relative_addresses=relative_addresses,
            )
        return str(caught.value)

    return tell
