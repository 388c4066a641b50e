"""A credential plugin: the program in `exec` of a kubeconfig's user.

Source: https://kubernetes.io/docs/reference/access-authn-authz/authentication/#client-go-credential-plugins
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from palaestra.cluster.errors import NotConfigured, Unreachable

VERSIONS = ("client.authentication.k8s.io/v1", "client.authentication.k8s.io/v1beta1")
WAIT_S = 300.0  # seconds for the whole run of a plugin, in which a person may have to log in
MOST_SAID = 300  # characters; a message quotes the end of a failed plugin's standard error
ALWAYS, NEVER = "Always", "Never"
MODES = (ALWAYS, NEVER, "IfAvailable")


@dataclass(frozen=True, slots=True, kw_only=True)
class Credentials:
    """The credentials from a plugin.

    Attributes:
        token: the bearer token for the header `Authorization`, or None.
        certificate: the certificate of the client, as PEM, or None.
        key: the private key of the certificate, as PEM, or None.
        expires: the time after which the plugin must run again; None: the credentials do not expire.
    """

    token: str | None
    certificate: str | None
    key: str | None
    expires: datetime | None


class Plugin:
    """The program of a kubeconfig's user, which returns credentials."""

    def __init__(self, entry: Mapping[str, Any], folder: Path, cluster: Mapping[str, Any]) -> None:
        """Check the entry in the kubeconfig.

        Args:
            entry: the field `exec` of the user.
            folder: folder of the kubeconfig; a command with a `/` is relative to this folder.
            cluster: the information about the cluster that the plugin gets.

        Raises:
            NotConfigured: the entry is invalid.
        """
        command, version = entry.get("command"), entry.get("apiVersion")
        if not isinstance(command, str) or not command:
            raise NotConfigured("exec: command is missing, or is not text; name the program")
        if version not in VERSIONS:
            raise NotConfigured(f"exec: apiVersion {version!r} is not known; use {' or '.join(VERSIONS)}")
        mode = entry.get("interactiveMode") or ("" if version == VERSIONS[0] else "IfAvailable")
        if mode not in MODES:
            raise NotConfigured(f"exec: interactiveMode {mode!r} is not known; use one of {', '.join(MODES)}")
        self._mode = mode
        self._version = str(version)
        self._command = command
        self._program = str(folder / command) if "/" in command else command
        self._arguments = [str(argument) for argument in entry.get("args") or ()]
        self._hint = " ".join(str(entry.get("installHint") or "").split())
        self._variables = _variables(entry.get("env") or ())
        self._cluster = cluster if entry.get("provideClusterInfo") else None

    def ask(self) -> Credentials:
        """Run the program and return its credentials.

        Raises:
            Unreachable: the program returned no credentials; the message has the reason.
        """
        interactive = self._mode != NEVER and sys.stdin is not None and sys.stdin.isatty()
        if self._mode == ALWAYS and not interactive:
            raise self._failure("needs a terminal for its prompts; run the command in a terminal")
        return self._read(self._run(interactive=interactive))

    def _run(self, *, interactive: bool) -> str:
        if shutil.which(self._program) is None:
            remedy = self._hint or "install it, or put it on the PATH"
            raise self._failure(f"is not installed; {remedy}")
        try:
            ended = subprocess.run(
                [self._program, *self._arguments],
                env={
                    **os.environ,
                    **self._variables,
                    "KUBERNETES_EXEC_INFO": self._question(interactive=interactive),
                },
                stdin=None if interactive else subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=None if interactive else subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                timeout=WAIT_S,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise self._failure(
                f"did not respond within {WAIT_S:.0f} s; run it by hand to see the reason"
            ) from error
        except (OSError, ValueError) as error:
            raise self._failure(f"cannot be run ({error})") from error
        if ended.returncode:
            said = " ".join((ended.stderr or "").split())[-MOST_SAID:]
            raise self._failure(f"failed with exit code {ended.returncode}{f': {said}' if said else ''}")
        return ended.stdout

    def _question(self, *, interactive: bool) -> str:
        spec: dict[str, Any] = {"interactive": interactive}
        if self._cluster is not None:
            spec["cluster"] = self._cluster
        return json.dumps({"apiVersion": self._version, "kind": "ExecCredential", "spec": spec})

    def _read(self, text: str) -> Credentials:
        try:
            answer = json.loads(text)
        except ValueError as error:
            raise self._failure(f"returned output that is not JSON ({error})") from error
        status = answer.get("status") if isinstance(answer, dict) else None
        if not isinstance(status, dict) or answer.get("kind") != "ExecCredential":
            raise self._failure("returned output that is not an ExecCredential with a status")
        if answer.get("apiVersion") != self._version:
            given = answer.get("apiVersion")
            raise self._failure(f"returned apiVersion {given!r}; the kubeconfig requires {self._version}")
        return self._given(status)

    def _given(self, status: Mapping[str, Any]) -> Credentials:
        token = str(status.get("token") or "").strip()
        certificate, key = status.get("clientCertificateData"), status.get("clientKeyData")
        if not token and not certificate:
            raise self._failure("returned neither a token nor a certificate")
        if bool(certificate) is not bool(key):
            raise self._failure("returned only one of certificate and key")
        if token and not (token.isascii() and token.isprintable()):
            raise self._failure(
                "returned a token with other characters than printable ASCII, such as a line break"
            )
        return Credentials(
            token=token or None,
            certificate=str(certificate) if certificate else None,
            key=str(key) if key else None,
            expires=self._expiry(status.get("expirationTimestamp")),
        )

    def _expiry(self, text: object) -> datetime | None:
        if not text:
            return None
        try:
            found = datetime.fromisoformat(str(text))
        except ValueError as error:
            raise self._failure(f"returned an expirationTimestamp that is not a time: {text!r}") from error
        return found if found.tzinfo else found.replace(tzinfo=UTC)

    def _failure(self, fact: str) -> Unreachable:
        return Unreachable(0, "NoCredentials", f"the credential plugin {self._command} {fact}")


def _variables(entries: Any) -> dict[str, str]:
    try:
        return {str(entry["name"]): str(entry["value"]) for entry in entries}
    except (TypeError, KeyError) as error:
        raise NotConfigured(
            "exec: env is not a list of names and values; write `name` and `value`"
        ) from error
