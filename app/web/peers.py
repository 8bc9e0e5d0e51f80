"""The other end of a connection: whether it is on this machine, and to which user it belongs."""

from __future__ import annotations

import asyncio
import ipaddress
import struct
import sys
from dataclasses import dataclass
from pathlib import Path

from websockets.datastructures import Headers

_ESTABLISHED = "01"
_BY_PROXIES = ("forwarded", "via", "x-real-ip")

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


def came_through_a_proxy(headers: Headers) -> bool:
    """Returns whether a proxy has forwarded the request for another client."""
    names = [name.lower() for name, _ in headers.raw_items()]
    return any(name in _BY_PROXIES or name.startswith("x-forwarded-") for name in names)


@dataclass(frozen=True)
class Ends:
    """The two ends of a connection: address and port of this end and of the other end."""

    ours: tuple[Address, int]
    theirs: tuple[Address, int]

    @property
    def near(self) -> bool:
        """Whether the other end is on this machine."""
        return self.theirs[0].is_loopback or self.theirs[0] == self.ours[0]

    @property
    def user(self) -> str:
        """The id of the user whose process is at the other end; "" if it is on another machine, or on systems
        other than Linux."""
        if sys.platform != "linux" or not self.near:
            return ""
        table = Path("/proc/net/tcp6" if self.theirs[0].version == 6 else "/proc/net/tcp")
        wanted = [_listed(*self.theirs), _listed(*self.ours), _ESTABLISHED]
        try:
            rows = [row.split() for row in table.read_text().splitlines()[1:]]
        except OSError:
            return ""
        return next((row[7] for row in rows if row[1:4] == wanted), "")


def ends_of(transport: asyncio.BaseTransport) -> Ends | None:
    """Returns the ends of a connection; None if it has no addresses."""
    ours, theirs = (_end(transport.get_extra_info(name)) for name in ("sockname", "peername"))
    return None if ours is None or theirs is None else Ends(ours, theirs)


def _end(found: object) -> tuple[Address, int] | None:
    """Returns address and port. An IPv4 address that is mapped to IPv6 is converted back."""
    if not isinstance(found, tuple) or len(found) < 2:
        return None
    address = ipaddress.ip_address(str(found[0]).partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return mapped or address, int(found[1])


def _listed(address: Address, port: int) -> str:
    """Returns an address in the form in which Linux lists it: 32-bit words in native byte order."""
    packed = address.packed
    words = struct.unpack(f"={len(packed) // 4}I", packed)
    return "".join(f"{word:08X}" for word in words) + f":{port:04X}"
