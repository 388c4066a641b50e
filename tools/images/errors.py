"""Errors for the person who typed `make images`."""


class ImagesError(Exception):
    """An image cannot be built here; the message says the thing, the fact and the remedy."""
