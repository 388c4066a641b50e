"""Keys and certificates of one control plane; openssl creates them, valid for one day."""

import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

CURVE = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-noenc")
DAY = ("-days", "1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """A certificate and its key, as files."""

    certificate: Path
    key: Path


@dataclass(frozen=True, slots=True)
class Authority:
    """The certificate authority of the server and of its clients; `folder` contains its files."""

    folder: Path

    @classmethod
    def create(cls, folder: Path, *extensions: str) -> "Authority":
        """Create the authority's key and certificate in an existing folder."""
        authority, subject = cls(folder), ("-subj", "/CN=control-plane")
        _openssl("req", "-x509", "-new", *CURVE, *DAY, *subject, *_added(extensions), *_files(authority.pair))
        return authority

    @property
    def pair(self) -> Pair:
        """The certificate and the key of the authority itself."""
        return Pair(certificate=self.folder / "ca.crt", key=self.folder / "ca.key")

    def server(self, addresses: Iterable[str]) -> Pair:
        """Create the certificate of a server with these IP addresses."""
        return self._issue(self.folder / "server", "/CN=kube-apiserver", _named(addresses))

    def bare_server(self, addresses: Iterable[str], days: int) -> Pair:
        """Create a server's certificate without key identifiers; with `days=-1`, it has expired."""
        pair, request, extensions = (self.folder / name for name in ("bare", "request", "extensions"))
        found = _pair(pair)
        no_identifiers = "subjectKeyIdentifier=none\nauthorityKeyIdentifier=none\n"
        extensions.write_text(f"{_named(addresses)}\n{no_identifiers}")
        asked = ("-out", str(request), "-keyout", str(found.key))
        _openssl("req", "-new", *CURVE, "-subj", "/CN=kube-apiserver", *asked)
        signer = ("-CA", str(self.pair.certificate), "-CAkey", str(self.pair.key), "-CAcreateserial")
        given = ("-in", str(request), "-extfile", str(extensions), "-days", str(days))
        _openssl("x509", "-req", *given, *signer, "-out", str(found.certificate))
        return found

    def client(self, user: str, group: str, folder: Path) -> Pair:
        """Create a user's certificate in a folder; with an empty `group`, the user is in no group."""
        subject = f"/O={group}/CN={user}" if group else f"/CN={user}"
        return self._issue(folder / user.replace(":", "-"), subject, "extendedKeyUsage=clientAuth")

    def signing_key(self) -> Path:
        """Create the key that signs the tokens of service accounts."""
        path = self.folder / "service-accounts.key"
        _openssl("genrsa", "-out", str(path), "2048")
        return path

    def _issue(self, path: Path, subject: str, *extensions: str) -> Pair:
        pair = _pair(path)
        signer = ("-CA", str(self.pair.certificate), "-CAkey", str(self.pair.key))
        usage = _added(("keyUsage=critical,digitalSignature", *extensions))
        _openssl("req", "-x509", "-new", *CURVE, *DAY, *signer, "-subj", subject, *usage, *_files(pair))
        return pair


def _pair(path: Path) -> Pair:
    return Pair(certificate=path.with_name(f"{path.name}.crt"), key=path.with_name(f"{path.name}.key"))


def _named(addresses: Iterable[str]) -> str:
    names = ["DNS:localhost", *(f"IP:{address}" for address in addresses)]
    return f"subjectAltName={','.join(names)}"


def _added(extensions: Iterable[str]) -> list[str]:
    return [part for extension in extensions for part in ("-addext", extension)]


def _files(pair: Pair) -> tuple[str, ...]:
    return ("-out", str(pair.certificate), "-keyout", str(pair.key))


def _openssl(*arguments: str) -> None:
    subprocess.run(["openssl", *arguments], check=True, capture_output=True, timeout=30)
