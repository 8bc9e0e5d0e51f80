"""Proofs of access: the token or the owner's secret in the address, and later a cookie derived from them, for
the user at the other end of the connection."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import ipaddress
import re
import secrets
import struct
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal
from urllib.parse import parse_qs, unquote, urlencode, urlsplit

from websockets.datastructures import Headers

from robots import InputError

QUERY = "himpc-token"
"""The name of the parameter in the address. It differs from `token`, the name that Jupyter uses."""
HEADER = "X-Himpc-Lab-Token"
"""The name of the header in which a proxy may send the token of its visitors."""
USER_HEADER = "X-Himpc-Lab-User"
"""The header in which a proxy that asks for passwords sends its visitor's name, percent-encoded UTF-8."""
VARIABLE = "HIMPC_LAB_TOKEN"
"""The environment variable with the user's own token."""
LONGEST_ACCOUNT = 80  # largest number of characters
SHORTEST = 16  # smallest number of characters of a user's own token
Role = Literal["guest", "owner"]
_ROLES: tuple[Role, ...] = ("owner", "guest")


def new_token() -> str:
    """Returns a random token of 128 bits, as text that can be part of an address."""
    return secrets.token_urlsafe(16)


def new_key() -> bytes:
    return secrets.token_bytes(32)


def given_token(file: str | None, environment: Mapping[str, str]) -> str | None:
    """Returns the user's own token, which several servers can have in common: the first line of a file, or
    the environment variable; None if neither exists. Raises InputError, which names the option or the
    variable, if the token is too short or has characters other than letters, digits, - and _."""
    text, place = environment.get(VARIABLE), VARIABLE
    if file is not None:
        place = f"--token-file {file}"
        try:
            text = Path(file).read_text(encoding="utf-8").partition("\n")[0]
        except (OSError, UnicodeDecodeError):
            raise InputError(f"{place}: cannot be read; give a text file with the token") from None
    if text is None:
        return None
    if not re.fullmatch(rf"[A-Za-z0-9_-]{{{SHORTEST},200}}", text.strip()):
        raise InputError(
            f"{place}: a token has {SHORTEST} characters or more (letters, digits, - and _): make one with "
            "python -c 'import secrets; print(secrets.token_urlsafe())'"
        )
    return text.strip()


def shared(token: str, owner: str | None) -> Passes:
    """Returns the passes of a server with a user's own token. The cookie of one such server opens all servers
    with this token."""
    key = hmac.new(token.encode(), b"cookie", hashlib.sha256).digest()
    return Passes(token, owner, "himpc-lab", key)


@dataclass(frozen=True)
class Passes:
    """The secrets of one server. They are valid until the server ends.

    Attributes:
        token: admits a visitor; None: no token is needed.
        owner: admits a visitor as the person who started the server; None: no page has this role.
        cookie: the cookie's name. Each server uses another name, as browsers send cookies to all ports of a
            host.
        key: the key from which cookies are derived. A cookie does not contain the secrets of the address.
    """

    token: str | None = field(default=None, repr=False)
    owner: str | None = field(default=None, repr=False)
    cookie: str = "himpc-lab"
    key: bytes = field(default_factory=new_key, repr=False)

    def link(self, address: str, role: Role, page: str = "") -> str:
        """Returns the address of a page for a visitor with this role. page: "" is the page of a robot."""
        secret = (role == "owner" and self.owner) or self.token
        place = f"{address}/{page}" if page or secret else address
        return f"{place}?{urlencode({QUERY: secret})}" if secret else place

    def in_address(self, path: str) -> Role | None:
        """Returns the role whose secret is in an address; None if there is none."""
        given = parse_qs(urlsplit(path).query).get(QUERY, [])
        known = (self.owner, self.token)
        return _first(any(_same(each, right) for each in given) for right in known)

    def in_header(self, headers: Headers) -> bool:
        """Returns whether a proxy sent the token in its header. The owner's secret is not accepted in the
        header."""
        given = headers.get_all(HEADER)
        return len(given) == 1 and _same(given[0], self.token)

    def account(self, headers: Headers) -> str:
        """Returns the visitor's name that the proxy sent together with the token; "" if it sent none."""
        given = headers.get_all(USER_HEADER)
        if len(given) != 1 or not self.in_header(headers):
            return ""
        return "".join(sign for sign in unquote(given[0])[:LONGEST_ACCOUNT] if sign.isprintable())

    def in_cookies(self, headers: Headers, who: str) -> Role | None:
        """Returns the role whose cookie is in a request from `who`, see `Ends.user`; None if there is
        none."""
        given = list(self._cookies(headers))
        right = {"guest": self._value("guest", who), "owner": self.owner and self._value("owner", who)}
        return _first(any(_same(each, right[role]) for each in given) for role in _ROLES)

    def keep(self, role: Role, who: str) -> str:
        """Returns the name and value of a visitor's cookie. The cookie is valid for `who` only, since
        browsers send it to all servers of the same host, also to servers of other users."""
        return f"{self.cookie}={self._value(role, who)}"

    def _value(self, role: Role, who: str) -> str:
        # Guests may be able to derive the key from their token, but they do not know the owner's secret.
        key = self.key + (self.owner or "").encode() if role == "owner" else self.key
        return hmac.new(key, f"{role} {who}".encode(), hashlib.sha256).hexdigest()

    def _cookies(self, headers: Headers) -> Iterable[str]:
        # Parsed here, because the library rejects the whole header if another server of this host has set an
        # unusual cookie.
        for part in ";".join(headers.get_all("Cookie")).split(";"):
            name, _, value = part.strip().partition("=")
            if name == self.cookie:
                yield value


def _first(brought: Iterable[bool]) -> Role | None:
    """Returns the first role whose secret or cookie was sent. All roles are compared, also after the first
    match."""
    found: list[Role] = [role for role, there in zip(_ROLES, list(brought), strict=True) if there]
    return found[0] if found else None


def _same(given: str, right: str | None) -> bool:
    return right is not None and secrets.compare_digest(given.encode(errors="replace"), right.encode())


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
