"""Whom the pods may talk to. Nothing here is used by `palaestra run`."""

from enum import StrEnum

from pydantic import Field

from palaestra.api.model import ApiModel


class Egress(StrEnum):
    """Whether the pods may call out."""

    OPEN = "Open"
    CLOSED = "Closed"


class Network(ApiModel):
    """Whom the pods may talk to; who may talk to them is not the job's to say."""

    egress: Egress = Field(default=Egress.OPEN, strict=False)
    """`Open`: the pods may call anything. `Closed`: nothing at all, names of hosts included; training
    needs none."""
