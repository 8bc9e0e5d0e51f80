"""The address at which a server listens, and the address with which other machines reach it."""

from __future__ import annotations

import errno
import socket
from urllib.parse import urlsplit

from robots import InputError

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Hosts that only this machine can reach."""


def check_address(host: str, port: int) -> None:
    """Raises InputError if no server can listen at this address."""
    if not 0 <= port <= 65535:
        raise InputError(f"Port {port} does not exist: give a port from 1024 to 65535.")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise address_in_use(host, port) from None
            reason = error.strerror or str(error)
            raise InputError(
                f"Cannot listen on {host}:{port} ({reason}): try --host 127.0.0.1 and another --port."
            ) from None


def address_in_use(host: str, port: int) -> InputError:
    """Returns the error for a port at which another program listens."""
    other = port + 1 if port < 65535 else port - 1
    return InputError(f"Port {port} on {host} is in use: choose another one, e.g. --port {other}.")


def local_url(host: str, port: int) -> str:
    """Returns the address of the server for this machine."""
    shown = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
    return f"http://{shown}:{port}"


def seen_from_outside(host: str, url: str) -> str:
    """Returns the address of the server for other machines without a proxy. This is the machine's address in
    its network if the server listens there, else `url`, the address for this machine."""
    if host not in ("0.0.0.0", "::"):
        return url
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect(("192.0.2.1", 9))  # no machine has this address; nothing is sent
            here = line.getsockname()[0]
        except OSError:
            here = socket.gethostname()
    return f"http://{here}:{urlsplit(url).port}"
