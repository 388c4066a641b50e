"""The handles of nodes and fields that a controller of Webots gives to its clients."""

import pytest

from palaestra_sim.webots.services.handles import UnknownHandleError, WebotsHandles


def test_a_null_pointer_has_the_handle_0() -> None:
    """A client recognizes a node or field that does not exist by the handle 0, as with Webots' controller."""
    handles = WebotsHandles()

    assert (handles.of_node(None), handles.of_field(None), handles.other_node(0)) == (0, 0, None)


@pytest.mark.parametrize("handle", [0, 7, -1])
def test_a_handle_that_no_service_returned_is_refused(handle) -> None:
    """Webots' library would follow the pointer, and the controller would crash."""
    handles = WebotsHandles()
    handles.of_field(99)

    with pytest.raises(UnknownHandleError, match="does not exist; get a new handle"):
        handles.node(handle)
    with pytest.raises(UnknownHandleError, match="does not exist; get a new handle"):
        handles.field(handle)
    assert handles.field(99) == 99


def test_the_handle_of_a_field_is_not_that_of_a_node() -> None:
    """Both handles are pointers, so the library could not distinguish them."""
    handles = WebotsHandles()

    assert (handles.of_node(5), handles.of_field(6)) == (5, 6)
    assert (handles.node(5), handles.other_node(5), handles.field(6)) == (5, 5, 6)
    for wrong in (lambda: handles.node(6), lambda: handles.other_node(6), lambda: handles.field(5)):
        with pytest.raises(UnknownHandleError):
            wrong()
