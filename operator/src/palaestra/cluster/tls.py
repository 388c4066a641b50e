"""The verification of an API server's certificate, and the reason for a refusal."""

import ssl
import tempfile
from pathlib import Path

# Source: OpenSSL's x509_vfy.h. All other codes are about the chain.
DATES = {9: "is not valid yet", 10: "has expired"}
NAMES = (62, 64)  # the certificate lacks the host's name, or the IP address
DATES_REMEDY = "compare this machine's clock with the certificate's dates, or have the certificate renewed"
NAMES_REMEDY = (
    "connect by a name that the certificate has, or set `tls-server-name` of the kubeconfig's cluster"
)
CHAIN_REMEDY = (
    "compare the trusted certificate authority (`certificate-authority` of the kubeconfig, ca.crt in a pod) "
    "with that of the cluster"
)


def verification(
    authority: Path | None = None, pem: str | None = None, *, verified: bool = True
) -> ssl.SSLContext:
    """Return the TLS settings that verify a server; without an authority, those of this machine are trusted.

    Chain, name and dates are checked, but not the authority's extensions: Python 3.13 requires extensions
    that the authorities of many clusters lack, and kubectl does not.

    Args:
        authority: the file of the certificate authority.
        pem: the certificate authority itself.
        verified: False: any certificate is accepted.

    Raises:
        OSError: the authority cannot be read.
        ValueError: it is not a certificate.
    """
    found = ssl.create_default_context(cafile=authority, cadata=pem)
    found.verify_flags &= ~ssl.VERIFY_X509_STRICT
    found.hostname_checks_common_name = False
    if not verified:
        found.check_hostname = False
        found.verify_mode = ssl.CERT_NONE
    return found


def add_identity(context: ssl.SSLContext, certificate: bytes, key: bytes) -> None:
    """Make new connections of a context send a client's certificate.

    Raises:
        OSError: the certificate or key is unusable.
    """
    with tempfile.TemporaryDirectory() as folder:  # ssl reads only files; other users cannot read the folder
        files = Path(folder) / "certificate", Path(folder) / "key"
        for file, content in zip(files, (certificate, key), strict=True):
            file.write_bytes(content)
        context.load_cert_chain(*files)


def refused_certificate(error: BaseException) -> tuple[str, str] | None:
    """Return the reason and remedy for a refused server certificate; None if the error is another one."""
    found = _verification_error(error)
    if found is None:
        return None
    if found.verify_code in DATES:
        return f"the server's certificate {DATES[found.verify_code]}", DATES_REMEDY
    if found.verify_code in NAMES:
        said = found.verify_message.rstrip(".")
        return f"the server's certificate is for another name ({said})", NAMES_REMEDY
    reason = f"the server's certificate is not from the trusted authority ({found.verify_message})"
    return reason, CHAIN_REMEDY


def _verification_error(error: BaseException) -> ssl.SSLCertVerificationError | None:
    """Return the error of the ssl library that other libraries have wrapped."""
    seen: list[BaseException] = []
    waiting: list[BaseException | None] = [error]
    while waiting:
        looked_at = waiting.pop()
        if isinstance(looked_at, ssl.SSLCertVerificationError):
            return looked_at
        if looked_at is None or looked_at in seen:
            continue
        seen.append(looked_at)
        inner = [given for given in looked_at.args if isinstance(given, BaseException)]
        waiting += [*inner, looked_at.__cause__, looked_at.__context__]
    return None
