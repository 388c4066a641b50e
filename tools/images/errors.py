"""Errors for the person who typed `make images`."""


class ImagesError(Exception):
    """An image cannot be built on this machine; the message has the object, the problem and the remedy."""
