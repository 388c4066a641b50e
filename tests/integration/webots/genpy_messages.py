"""Requests and messages of genpy's classes as JSON data."""

import keyword

import genpy
import genpy.message


def request_of(service, fields):
    """Return a request of a genpy class with these fields; the other fields have their defaults."""
    message = service._request_class()
    named = {f"{name}_" if keyword.iskeyword(name) else name: value for name, value in fields.items()}
    genpy.message.fill_message_args(message, [named])
    return message


def plain(value):
    """Return a message, or a value inside one, as JSON data."""
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, genpy.Time | genpy.Duration):
        return value.to_sec()
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value
