"""The credentials of a kubeconfig's user: the header `Authorization`, and a client certificate.

The rules are those of client-go. A user may have a token or a password, not both. A token file has priority
over a token. A plugin is used only if the user has neither a token nor a password.
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
    """Return a function that returns the header `Authorization` of a user; an auth-provider is ignored.

    Args:
        user: the user's settings in a kubeconfig, such as `token` or `exec`.
        folder: the folder of the kubeconfig; relative paths start in this folder.
        cluster: the information about the cluster that a plugin gets.
        context: the TLS settings, to which a plugin's certificate is added.

    Raises:
        NotConfigured: the user has several kinds of credentials, or they are invalid.
    """
    by_token = bool(user.get(TOKEN) or user.get(TOKEN_FILE))
    by_password = bool(user.get(NAME) or user.get(PASSWORD))
    if by_token and by_password:
        raise NotConfigured(f"the user of the kubeconfig has both {TOKEN} and {NAME}; remove one of them")
    if user.get(EXEC) and user.get(PROVIDER):
        raise NotConfigured(f"the user of the kubeconfig has both {EXEC} and {PROVIDER}; remove one of them")
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
    """A function that returns the header from a plugin's credentials, which it caches until they expire."""

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
        raise NotConfigured(
            f"{TOKEN_FILE}: {file} is missing, empty, unreadable or not ASCII; "
            "log in again, or name another file"
        )
    return FileToken(file, time.monotonic)


def _always(header: str | None) -> Authorization:
    return lambda: header


def _one_line(text: object, field: str) -> str:
    found = str(text).strip()
    if not found or not found.isascii() or not found.isprintable():
        raise NotConfigured(
            f"{field} is empty, or has other characters than printable ASCII, such as a line break; "
            "copy it again, on one line"
        )
    return found
