"""Network access of the pods. `palaestra run` ignores all of it."""

from enum import StrEnum

from pydantic import Field

from palaestra.api.model import ApiModel


class Egress(StrEnum):
    """Whether the pods may open connections."""

    OPEN = "Open"
    CLOSED = "Closed"


class Network(ApiModel):
    """Connections that the pods may open; a job cannot change which connections reach its pods."""

    egress: Egress = Field(default=Egress.OPEN, strict=False)
    """`Open`: the pods may connect to anything. `Closed`: to nothing, not even to DNS; training needs no
    connection."""
