"""Encode and decode the requests and responses of XML-RPC.

Python's own XML-RPC reader expands entities and accepts values nested at any depth, so a small document can
exhaust memory. This reader refuses a document type, which is the only way to declare entities, and it limits
the depth of values.
"""

from __future__ import annotations

import xmlrpc.client
from typing import Any
from xml.parsers import expat

MOST_DEPTH = 64  # levels of arrays and structs; a tree of ROS parameters has far fewer
FAULT = 1  # the code of every fault; ROS clients read only the text
_NESTING = frozenset({"array", "struct"})


class UnreadableDocument(ValueError):
    """The bytes are not an XML-RPC document, or the document exceeds a limit."""


def encode_request(method: str, parameters: tuple[Any, ...]) -> bytes:
    """Return the request that calls `method` with `parameters`.

    Raises:
        TypeError, OverflowError: XML-RPC cannot express a parameter.
    """
    return xmlrpc.client.dumps(parameters, method).encode()


def encode_response(value: Any) -> bytes:
    """Return the response of a call that returns `value`.

    Raises:
        TypeError, OverflowError: XML-RPC cannot express the value.
    """
    return xmlrpc.client.dumps((value,), methodresponse=True).encode()


def encode_fault(text: str) -> bytes:
    """Return the response of a call that failed; `text` is the reason."""
    return xmlrpc.client.dumps(xmlrpc.client.Fault(FAULT, text)).encode()


def decode_request(data: bytes) -> tuple[str, tuple[Any, ...]]:
    """Return the method and the parameters of a request.

    Raises:
        UnreadableDocument: `data` is not an XML-RPC request, or it exceeds a limit.
    """
    reader = _read(data)
    method = reader.getmethodname()
    if method is None:
        raise UnreadableDocument("XML-RPC: the request names no method")
    return method, _values(reader)


def decode_response(data: bytes) -> Any:
    """Return the value of a response.

    Raises:
        UnreadableDocument: `data` is not an XML-RPC response, or it exceeds a limit.
        xmlrpc.client.Fault: the response reports that the call failed.
    """
    values = _values(_read(data))
    if len(values) != 1:
        raise UnreadableDocument(f"XML-RPC: the response has {len(values)} values, not 1")
    return values[0]


def _read(data: bytes) -> xmlrpc.client.Unmarshaller:
    reader = xmlrpc.client.Unmarshaller()
    parser = expat.ParserCreate()
    depth = 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += tag in _NESTING
        if depth > MOST_DEPTH:
            raise UnreadableDocument(f"XML-RPC: values are nested deeper than {MOST_DEPTH} levels")
        reader.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= tag in _NESTING
        reader.end(tag)

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    parser.CharacterDataHandler = reader.data
    parser.StartDoctypeDeclHandler = _refuse_document_type
    reader.xml("", None)  # no encoding, because expat decodes the text
    try:
        parser.Parse(data, True)
    except UnreadableDocument:
        raise
    except (
        Exception
    ) as error:  # the parser raises many types: ExpatError, ValueError, IndexError, binascii.Error, ...
        raise UnreadableDocument(f"XML-RPC: {error!r}") from error
    return reader


def _refuse_document_type(*_: object) -> None:
    raise UnreadableDocument("XML-RPC: the document has a DOCTYPE, which is not allowed")


def _values(reader: xmlrpc.client.Unmarshaller) -> tuple[Any, ...]:
    try:
        return reader.close()
    except xmlrpc.client.ResponseError as error:
        raise UnreadableDocument("XML-RPC: the document ends before its values") from error
