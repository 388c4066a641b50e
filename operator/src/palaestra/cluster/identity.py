"""The credentials of a kubeconfig's user, as a header and as a certificate of the client.

The rules are client-go's: at most one way to log in, a token file before a token, a plugin without both.
"""

import ssl
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from urllib3.util import make_headers

from palaestra.cluster.errors import NotConfigured, Unreachable
from palaestra.cluster.plugin import Credentials, Plugin
from palaestra.cluster.tls import add_identity
from palaestra.cluster.tokens import FileToken, text_of

Authorization = Callable[[], str | None]
TOKEN, TOKEN_FILE, NAME, PASSWORD = "token", "tokenFile", "username", "password"
EXEC, PROVIDER = "exec", "auth-provider"


def authorization(
    user: Mapping[str, Any], folder: Path, cluster: Mapping[str, Any], context: ssl.SSLContext
) -> Authorization:
    """Return a function for the header `Authorization` of a user; it ignores an auth-provider.

    Args:
        user: the user in a kubeconfig.
        folder: the folder of that kubeconfig; relative paths start there.
        cluster: the information about the cluster for a plugin.
        context: receives the certificate of a plugin's credentials.

    Raises:
        NotConfigured: the user has several ways to log in, or one is wrong.
    """
    by_token = bool(user.get(TOKEN) or user.get(TOKEN_FILE))
    by_password = bool(user.get(NAME) or user.get(PASSWORD))
    if by_token and by_password:
        raise NotConfigured(f"the user has both {TOKEN} and {NAME}; remove one")
    if user.get(EXEC) and user.get(PROVIDER):
        raise NotConfigured(f"the user has both {EXEC} and {PROVIDER}; remove one")
    if user.get(TOKEN_FILE):
        return _of_file(folder / str(user[TOKEN_FILE]))
    if by_token:
        return _always(f"Bearer {_one_line(user[TOKEN], TOKEN)}")
    if by_password:
        pair = f"{user.get(NAME) or ''}:{user.get(PASSWORD) or ''}"
        return _always(make_headers(basic_auth=pair)["authorization"])
    if user.get(EXEC):
        if not isinstance(user[EXEC], Mapping):
            raise NotConfigured(
                f"{EXEC}: {user[EXEC]!r} is not a mapping; write command and apiVersion under it"
            )
        return _OfPlugin(Plugin(user[EXEC], folder, cluster), context)
    return _always(None)


class _OfPlugin:
    """The header from a plugin's credentials, which are cached until they expire."""

    def __init__(self, plugin: Plugin, context: ssl.SSLContext) -> None:
        self._plugin = plugin
        self._context = context
        self._last: Credentials | None = None

    def __call__(self) -> str | None:
        """Return the header; None if the plugin returned only a certificate.

        Raises:
            Unreachable: the plugin did not return usable credentials.
        """
        last = self._last
        if last is None or (last.expires is not None and datetime.now(UTC) >= last.expires):
            last = self._plugin.ask()
            if last.certificate and last.key:
                self._show(last.certificate, last.key)
            self._last = last
        return f"Bearer {last.token}" if last.token else None

    def _show(self, certificate: str, key: str) -> None:
        try:
            add_identity(self._context, certificate.encode(), key.encode())
        except OSError as error:
            fact = f"the credential plugin's certificate and key cannot be used together ({error})"
            raise Unreachable(0, "NoCredentials", fact) from error


def _of_file(file: Path) -> Authorization:
    if not text_of(file):
        raise NotConfigured(f"{TOKEN_FILE}: {file} is missing or empty; log in again, or name another file")
    return FileToken(file, time.monotonic)


def _always(header: str | None) -> Authorization:
    return lambda: header


def _one_line(text: object, field: str) -> str:
    found = str(text).strip()
    if not found or not found.isascii() or not found.isprintable():
        raise NotConfigured(f"{field} is not one line of text; write it as it was given")
    return found
