"""In ROS's Slave API, the call `shutdown` has a reason: it names the node that the master wants to end."""

from __future__ import annotations

import re
from typing import Final

# Source: rosmaster, which writes "[/node] Reason: new node registered with same name".
_NAMED: Final = re.compile(r"\[(/[^\]\s]+)\] Reason: ")


def means_another_node(reason: object, node: str) -> bool:
    """Return whether a master wants to end a node other than `node`, which is a full name such as /robotino.

    A node that was killed stays registered. If its name is registered again, the master calls the old
    address, and the port may belong to another node now.
    """
    named = _NAMED.match(reason) if isinstance(reason, str) else None
    return named is not None and named[1] != node
