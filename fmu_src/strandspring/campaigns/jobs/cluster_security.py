"""How the connection to a dask.distributed scheduler is secured."""

from __future__ import annotations

import ipaddress
import ssl
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .runners import JobError

if TYPE_CHECKING:
    from distributed.security import Security

_ENCRYPTED = ("tls", "wss", "inproc")


def protocol_of(address: str) -> str:
    """The protocol of a scheduler's address; dask's default, tcp, if it names none."""
    protocol, separator, _ = address.partition("://")
    return protocol if separator else "tcp"


def secured(address: str, certificates: Mapping[str, str], notify: Callable[[str], None]) -> Security:
    """What the connection to a scheduler is made with.

    Parameters
    ----------
    address : str            Of the scheduler.
    certificates : mapping   Paths by the names of dask's `Security`; others are taken from dask's own configuration.
    notify : callable        Called with a caution where there is no TLS on the way to another computer.

    Raises
    ------
    JobError                 If certificates are missing or cannot be used.
    """
    from distributed.security import Security

    protocol = protocol_of(address)
    security = Security(**certificates)
    if protocol != "tls":
        if protocol not in _ENCRYPTED and not _is_local(address):
            notify(
                f"Caution: {address} has no TLS, and anyone who can reach that scheduler can execute code "
                "there and here; use tls:// unless you trust everybody on the network."
            )
        return security
    role = security.get_tls_config_for_role("client")
    authority, certificate, key = role["ca_file"], role["cert"], role["key"]
    if authority is None or certificate is None:
        raise JobError(
            f"{address} needs certificates: those of the authority (`tls_ca_file=...`) and of this client "
            "(`tls_cert=...`, `tls_key=...`), here or in dask's configuration (distributed.comm.tls)."
        )
    for path in (authority, certificate, key):
        # dask's configuration may hold a certificate itself, which has several lines.
        if path is not None and "\n" not in path and not Path(path).is_file():
            raise JobError(f"{path}: no such file; give the path of a certificate or key in PEM format.")
    try:
        if "\n" not in certificate:
            # With a passphrase, since OpenSSL would ask for that of a key on the terminal.
            ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_cert_chain(certificate, key, password="")
        security.get_connection_args("client")
    except (OSError, ValueError) as problem:
        raise JobError(
            f"The certificates for {address} cannot be used ({problem}); they must be in PEM format, and the "
            "key must belong to the certificate and have no passphrase."
        ) from None
    return security


def _is_local(address: str) -> bool:
    """Whether an address is one of this computer that no other reaches."""
    from distributed.comm.addressing import get_address_host

    try:
        host = get_address_host(address)
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, or no address at all
        return False
