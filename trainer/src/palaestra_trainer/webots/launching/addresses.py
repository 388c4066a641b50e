"""IP addresses in URLs, and addresses that only this machine can reach; pure."""

from __future__ import annotations

import ipaddress


def is_loopback(host: str) -> bool:
    """Return whether a host is an address or a name of the loopback interface."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def in_url(address: str) -> str:
    """Return an IP address as URLs write it: IPv6 in brackets."""
    return f"[{address}]" if ":" in address else address
