"""The verification of an API server's certificate, and the reasons for which a certificate is refused."""

import ssl
import tempfile
from pathlib import Path

# Source: OpenSSL's x509_vfy.h. `refused_certificate` attributes all other errors to the certificate's chain.
DATES = {9: "is not valid yet", 10: "has expired"}
NAMES = (62, 64)  # the certificate contains neither the host's name nor its IP address
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
    """Return the TLS settings that verify a server; by default, they trust this machine's authorities.

    Chain, name and dates are checked, but not the extensions of the authority's certificate. Python 3.13
    requires extensions that the authorities of many clusters lack; kubectl does not require them.

    Args:
        authority: the file of the certificate authority.
        pem: the certificate authority as PEM text.
        verified: whether to verify the certificate; False accepts any certificate.

    Raises:
        OSError: the authority cannot be read.
        ValueError: the authority is not a certificate.
    """
    found = ssl.create_default_context(cafile=authority, cadata=pem)
    found.verify_flags &= ~ssl.VERIFY_X509_STRICT
    found.hostname_checks_common_name = False
    if not verified:
        found.check_hostname = False
        found.verify_mode = ssl.CERT_NONE
    return found


def add_identity(context: ssl.SSLContext, certificate: bytes, key: bytes) -> None:
    """Add a client certificate, which new connections of the context will send.

    Raises:
        OSError: the certificate or key is unusable.
    """
    # The `ssl` module reads a certificate and a key only from files. So they are written to a folder that
    # other users cannot read.
    with tempfile.TemporaryDirectory() as folder:
        files = Path(folder) / "certificate", Path(folder) / "key"
        for file, content in zip(files, (certificate, key), strict=True):
            file.write_bytes(content)
        context.load_cert_chain(*files)


def refused_certificate(error: BaseException) -> tuple[str, str] | None:
    """Return reason and remedy if an error is a refused server certificate; None for any other error."""
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
    """Return the ssl library's error inside the errors of other libraries, or None."""
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
