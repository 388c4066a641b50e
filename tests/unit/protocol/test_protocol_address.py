"""The addresses that a server listens on."""

import pytest

from palaestra_protocol.http import Address


@pytest.mark.parametrize("text", ["127.0.0.1:7100", "0.0.0.0:0", "[::1]:65535"])
def test_an_address_is_written_as_it_is_read(text) -> None:
    """A program that starts a sidecar parses the address in the sidecar's first line of output."""
    assert str(Address.parse(text)) == text


@pytest.mark.parametrize(
    "text", ["", "7100", ":7100", "localhost:1", "127.0.0.1:65536", "127.0.0.1:x", "::1"]
)
def test_what_is_no_address_with_a_port_is_refused(text) -> None:
    """A host name is refused too, because its address may change."""
    with pytest.raises(ValueError, match=r"is not an address such as 127\.0\.0\.1:7100$"):
        Address.parse(text)
