"""Access to the server: every request is checked before it is answered and before a socket is opened."""

from __future__ import annotations

from http import HTTPStatus
from pathlib import Path

import pytest
import viser
from websockets.datastructures import Headers
from websockets.http11 import Request

from app.web.door import Answer, Door, as_origin, under_its_name
from app.web.passes import HEADER, QUERY, USER_HEADER, VARIABLE, Passes, given_token, new_token, shared
from robots import InputError

OURS = "127.0.0.1:8080"
TOKEN = new_token()
LOCAL = Door()
OWNER = new_token()
PASSES = Passes(TOKEN, OWNER, cookie="himpc-lab-8080")
TOKENED = Door(local=False, passes=PASSES, names=frozenset({"lab", "lab.local"}))
COOKIE = PASSES.keep("guest", "")
PROXIED = Door(trusted=frozenset({"https://lab.example.org"}))


def asked(path: str = "/", **headers: str | list[str]) -> Request:
    """Returns a request. The keywords are headers, with _ in place of -."""
    given = Headers()
    for name, values in {"Host": OURS, **headers}.items():
        for value in values if isinstance(values, list) else [values]:
            given[name.replace("_", "-")] = value
    return Request(path, given)


def judged(door: Door, path: str = "/", **headers: str | list[str]) -> Answer | None:
    return door.judge(asked(path, **headers))


@pytest.mark.parametrize("upgrade", [{}, {"Upgrade": "websocket"}])
@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": ""},
        {"Origin": "http://127.0.0.1:9999"},  # another page of this machine
        {"Origin": "http://localhost:8080"},  # differs from the address of the page
        {"Origin": f"https://{OURS}"},
        {"Origin": f"http://{OURS}.evil.example"},
        {"Origin": f"http://evil.example@{OURS}"},
        {"Origin": [f"http://{OURS}", "https://evil.example"]},
        {"Host": "evil.example:8080", "Origin": "http://evil.example:8080"},  # DNS rebinding
        {"Host": "evil.example:8080"},
        {"Host": "localhost.evil.example:8080"},
        {"Host": "192.168.0.7:8080"},
        {"Host": ["127.0.0.1:8080", "evil.example"]},
        {"Host": []},
        {"Host": ""},
        {"Host": "[::1"},
        {"Host": "127.0.0.1:8080@evil.example"},
    ],
    ids=str,
)
def test_other_sites_are_refused(headers: dict[str, str | list[str]], upgrade: dict[str, str]) -> None:
    answer = judged(LOCAL, **headers, **upgrade)
    assert answer is not None and answer.status is HTTPStatus.FORBIDDEN


@pytest.mark.parametrize("host", [OURS, "localhost:8080", "[::1]:8080", "localhost:9000", "LOCALHOST:8080"])
def test_our_own_page_comes_in(host: str) -> None:
    """The page is also allowed through a tunnel with another port."""
    assert judged(LOCAL, Host=host) is None
    assert judged(LOCAL, Host=host, Origin=f"http://{host.lower()}", Upgrade="websocket") is None


def test_links_from_elsewhere_work_and_parts_of_other_pages_do_not() -> None:
    link = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}
    assert judged(LOCAL, **link) is None
    assert judged(LOCAL, **{**link, "Sec_Fetch_Dest": "iframe"}) is not None
    assert judged(LOCAL, Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="no-cors", Sec_Fetch_Dest="image")
    assert judged(LOCAL, Sec_Fetch_Site="same-site", Sec_Fetch_Mode="cors", Sec_Fetch_Dest="empty")
    assert judged(LOCAL, Sec_Fetch_Site="same-origin", Sec_Fetch_Mode="cors") is None


@pytest.mark.parametrize("upgrade", [{}, {"Upgrade": "websocket"}])
@pytest.mark.parametrize(
    ("path", "cookie"),
    [
        ("/", ""),
        (f"/?{QUERY}=", ""),
        (f"/?{QUERY}=%ED%A0%80", ""),
        (f"/?{QUERY}={TOKEN[:-1]}", ""),
        (f"/?token={TOKEN}", ""),
        ("/", f"{COOKIE}x"),
        ("/", COOKIE.replace("8080", "9090")),  # cookie of another himpc-lab
        ("/", f"himpc-lab-8080={TOKEN}"),
        ("/", PASSES.keep("guest", "1000")),
        ("/", "himpc-lab-8080=\xe4"),
        ("/", "=;=;,;"),
    ],
    # The token differs between processes, and pytest-xdist needs equal names of tests in all processes.
    ids=[
        "none",
        "empty",
        "no text",
        "too short",
        "by Jupyter's name",
        "too long",
        "of another lab",
        "the token itself",
        "of another user",
        "foreign letters",
        "rubbish",
    ],
)
def test_without_the_token_nothing(path: str, cookie: str, upgrade: dict[str, str]) -> None:
    answer = judged(TOKENED, path, Cookie=cookie, **upgrade)
    assert answer is not None and answer.status is HTTPStatus.FORBIDDEN
    assert "token" in answer.title and TOKEN not in answer.text


@pytest.mark.parametrize("secret", [TOKEN, OWNER], ids=["token", "owner's secret"])
def test_the_token_moves_from_the_address_into_a_cookie(secret: str) -> None:
    answer = judged(TOKENED, f"/?fixedDpr=1&{QUERY}={secret}")
    assert answer is not None and answer.status is HTTPStatus.SEE_OTHER
    headers = dict(answer.headers)
    assert headers["Location"] == "./?fixedDpr=1" and headers["Cache-Control"] == "no-store"
    assert secret not in str(answer)
    cookie, *attributes = headers["Set-Cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict"} == set(attributes)
    assert judged(TOKENED, Cookie=f'odd={{"a": [1, "é"]}}; {cookie}') is None
    own = {"Origin": f"http://{OURS}", "Upgrade": "websocket"}
    assert judged(TOKENED, Cookie=cookie, **own) is None
    assert judged(TOKENED, Cookie=cookie, **{**own, "Origin": "https://evil.example"}) is not None
    # A page of ours that was opened by a link on another site reloads itself, because the browser sends the
    # cookie only then.
    answer = judged(TOKENED, f"/?{QUERY}={secret}", Referer="https://mail.example/")
    assert answer is not None and answer.status is HTTPStatus.OK
    assert dict(answer.headers)["Refresh"] == "0; url=./"


def test_the_owner_is_who_brings_the_owners_secret_and_through_no_proxy() -> None:
    upgrade = {"Upgrade": "websocket"}
    mine, theirs = PASSES.keep("owner", "1000"), PASSES.keep("guest", "1000")
    assert TOKENED.is_owner(asked(f"/?{QUERY}={OWNER}", **upgrade))
    assert TOKENED.is_owner(asked(Cookie=mine, **upgrade), "1000")
    assert not TOKENED.is_owner(asked(Cookie=mine, **upgrade), "1001")
    assert not TOKENED.is_owner(asked(f"/?{QUERY}={TOKEN}", Cookie=theirs, **upgrade), "1000")
    assert not TOKENED.is_owner(asked(**upgrade)) and not Door().is_owner(asked(**upgrade))
    assert not Door().is_owner(asked(f"/?{QUERY}=", Cookie="himpc-lab=", **upgrade))
    for name in ("X_Forwarded_For", "x_forwarded_proto", "Forwarded", "Via", "X_Real_IP"):
        assert judged(TOKENED, f"/?{QUERY}={OWNER}", **upgrade, **{name: ""}) is None
        assert not TOKENED.is_owner(asked(f"/?{QUERY}={OWNER}", **upgrade, **{name: ""}))


@pytest.mark.parametrize("name", ["websocket", "playbackPath", "web%73ocket"])
def test_an_address_that_leads_the_page_to_another_server_is_refused(name: str) -> None:
    """viser's page would connect to that server and run its messages as a part of our page, whose cookie
    opens our sockets."""
    for door in (LOCAL, TOKENED):
        answer = judged(door, f"/?fixedDpr=1&{name}=ws://127.0.0.1:9999", Cookie=COOKIE)
        assert answer is not None and "another server" in answer.text


def test_beyond_this_machine_addresses_and_our_own_names_are_ours() -> None:
    """A host name that merely resolves to this machine is refused, with or without a token, because it may
    belong to anybody."""
    for door in (TOKENED, Door(local=False, names=TOKENED.names)):
        refused = judged(door, Host="evil.example:8080", Origin="http://evil.example:8080")
        assert refused is not None and "--trusted-origin" in refused.text
        for host in ("192.168.0.7:8080", "lab:8080", "lab.local:8080", "[fe80::1]:8080"):
            answer = judged(door, Host=host, Cookie=COOKIE)
            assert answer is None


def test_a_trusted_proxy() -> None:
    """A trusted proxy is accepted whether it passes the host on or not; other origins are refused."""
    origin = {"Origin": "https://lab.example.org"}
    assert judged(PROXIED, Host="lab.example.org", **origin) is None
    assert judged(PROXIED, Host=OURS, **origin) is None
    assert judged(PROXIED, Host="lab.example.org") is None
    assert judged(PROXIED, Host="lab.example.org", Origin="https://evil.example") is not None
    assert judged(PROXIED, Host="lab.example.org", Origin="https://lab.example.org.evil.example") is not None
    assert judged(PROXIED, Host="evil.example", **origin) is not None
    secure = Door(trusted=PROXIED.trusted, passes=PASSES)
    answer = judged(secure, f"/?{QUERY}={TOKEN}", Host="lab.example.org")
    assert answer is not None and "; Secure" in dict(answer.headers)["Set-Cookie"]


def test_origins_are_written_as_browsers_do() -> None:
    assert as_origin("https://Lab.Example.org/") == "https://lab.example.org"
    assert as_origin("https://lab.example.org:443") == "https://lab.example.org"
    assert as_origin("http://lab:8080") == "http://lab:8080"
    assert as_origin("http://[fe80::1]:8080") == "http://[fe80::1]:8080"
    for wrong in ("lab.example.org", "https://", "*", "https://lab/page", "ftp://lab", "https://a:b", "null"):
        with pytest.raises(InputError, match=r"--trusted-origin.*https://lab.example.org"):
            as_origin(wrong)


def test_a_proxy_may_send_the_token_in_its_header() -> None:
    """The owner's secret is not accepted in this header, and pages of other sites are refused as before."""
    own = {"Origin": f"http://{OURS}", "Upgrade": "websocket"}
    assert judged(TOKENED, X_Himpc_Lab_Token=TOKEN, **own) is None
    assert judged(TOKENED, X_Himpc_Lab_Token=TOKEN) is None
    for wrong in (OWNER, "", f"{TOKEN}x", [TOKEN, TOKEN]):
        assert judged(TOKENED, X_Himpc_Lab_Token=wrong, **own) is not None
    assert judged(TOKENED, X_Himpc_Lab_Token=TOKEN, Origin="https://evil.example") is not None
    assert not TOKENED.is_owner(asked(X_Himpc_Lab_Token=OWNER))


def test_a_door_for_one_proxy_lets_in_nobody_else() -> None:
    """Only the header opens the server, under any host name. The proxy's own pages may open web sockets, and
    the account is accepted only from the proxy."""
    door = Door(passes=shared(TOKEN, OWNER), proxy_only=True)
    by_proxy = {"Host": "hub.example.org", HEADER.replace("-", "_"): TOKEN}
    account = {USER_HEADER.replace("-", "_"): "zo%C3%AB%0A"}
    assert judged(door, **by_proxy) is None
    for origin, right in (
        ("https://hub.example.org", True),
        ("http://hub.example.org", True),
        ("https://evil.example", False),
        ("https://hub.example.org.evil.example", False),
        ("null", False),
    ):
        assert (judged(door, **by_proxy, Origin=origin, Upgrade="websocket") is None) is right
    cookie = door.passes.keep("owner", "")
    for path, headers in (
        (f"/?{QUERY}={TOKEN}", {}),
        (f"/?{QUERY}={OWNER}", {}),
        ("/", {"Cookie": cookie}),
        ("/", {HEADER.replace("-", "_"): f"{TOKEN}x"}),
        ("/", {HEADER.replace("-", "_"): [TOKEN, TOKEN]}),
    ):
        answer = judged(door, path, **headers, **account)
        assert answer is not None and answer.status is HTTPStatus.FORBIDDEN
        assert door.account(asked(path, **headers, **account)) == ""
    assert door.account(asked(**by_proxy, **account)) == "zoë"
    assert door.account(asked(**by_proxy)) == ""
    everybody = Door(passes=shared(TOKEN, OWNER))  # many people have this token
    assert everybody.account(asked(**by_proxy, **account)) == ""


def test_a_request_with_two_accounts_is_refused() -> None:
    """A proxy that appends its header to the visitor's own does not decide which of the two is right."""
    door = Door(passes=shared(TOKEN, OWNER), proxy_only=True)
    named = USER_HEADER.replace("-", "_")
    for given in (["zoe", "prof"], ["zoe", "zoe"], ["", "zoe"]):
        for upgrade in ({}, {"Upgrade": "websocket"}):
            answer = judged(door, **{HEADER.replace("-", "_"): TOKEN, named: given}, **upgrade)
            assert answer is not None and "two accounts" in answer.text
    assert judged(door, **{HEADER.replace("-", "_"): TOKEN, named: "zoe"}) is None


def test_a_door_for_one_proxy_takes_only_plain_addresses() -> None:
    """nginx treats the first four addresses as /v/x, for which it may ask for no password, and passes them on
    unchanged."""
    door = Door(passes=shared(TOKEN, OWNER), proxy_only=True)
    by_proxy = {HEADER.replace("-", "_"): TOKEN}
    for path in ("//v/x", "/%76/x", "/x/../v/x", "/./v/x", "/v/x#y", "http://lab/v/x", "/v\\x", "/é", "/x//"):
        for upgrade in ({}, {"Upgrade": "websocket"}):
            answer = judged(door, path, **by_proxy, **upgrade)
            assert answer is not None and "unusual" in answer.text, path
    for path in ("/", "/page", "/page?fixedDpr=1&a=%2F..//", "/class.csv", "/v/x", "/v/"):
        assert judged(door, path, **by_proxy) is None, path
    folder = Path(viser.__file__).parent / "client" / "build"
    files = [each.relative_to(folder).as_posix() for each in folder.rglob("*") if each.is_file()]
    assert files and all(judged(door, f"/{each}", **by_proxy) is None for each in files)


def test_servers_with_one_token_take_each_others_cookies_but_no_owner_is_made_of_it() -> None:
    """Whoever has the token can compute the key, but the owner's cookie also needs the owner's secret."""
    first, second = shared(TOKEN, OWNER), shared(TOKEN, new_token())
    cookie = first.keep("guest", "")
    assert judged(Door(passes=second), Cookie=cookie) is None
    assert judged(Door(passes=shared(new_token(), None)), Cookie=cookie) is not None
    assert not Door(passes=second).is_owner(asked(Cookie=first.keep("owner", "")))
    for owner in (None, OWNER):
        forged = Passes(TOKEN, None, first.cookie, first.key).keep("owner", "")
        assert not Door(passes=shared(TOKEN, owner)).is_owner(asked(Cookie=forged))
    assert Door(passes=first).is_owner(asked(Cookie=first.keep("owner", "")))


def test_a_token_of_ones_own_comes_from_a_file_or_the_environment(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\nmore\n")
    assert given_token(str(file), {VARIABLE: "x"}) == TOKEN
    assert given_token(None, {VARIABLE: TOKEN}) == TOKEN
    assert given_token(None, {}) is None
    for wrong in ("short", "with spaces and so on", "ä" * 20):
        with pytest.raises(InputError, match="16 characters"):
            given_token(None, {VARIABLE: wrong})
    with pytest.raises(InputError, match="cannot be read"):
        given_token(str(tmp_path / "none"), {})


def test_only_the_embedders_may_show_the_page_in_a_frame() -> None:
    """Without an embedder, nobody may. The browser compares the origins; other ways to embed are refused."""
    for origins, policy in (
        (frozenset[str](), "frame-ancestors 'none'"),
        (
            frozenset({"https://b.example", "https://a.example"}),
            "frame-ancestors https://a.example https://b.example",
        ),
    ):
        door, headers = Door(embedders=origins), Headers()
        door.secure(headers)
        assert headers["Content-Security-Policy"] == policy
        assert ("X-Frame-Options" in headers) is not bool(origins)
        for dest, right in (("iframe", bool(origins)), ("embed", False), ("object", False), ("frame", False)):
            frame = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": dest}
            assert (judged(door, **frame) is None) is right
        assert judged(door, Origin="https://a.example", Upgrade="websocket") is not None


@pytest.mark.parametrize("given", ["websocket=wss://evil.example", "playbackPath=https://evil.example/x"])
def test_a_server_in_the_address_of_the_page_below_a_path_is_taken_out(given: str) -> None:
    """viser's page adds its own server there, and a reload sends it. Another server has no effect either."""
    request = asked(f"/page?{given}&fixedDpr=1", X_Forwarded_Prefix="/user/zoe/lab")
    assert LOCAL.judge(request) is None
    moved = under_its_name(request)
    assert moved is not None and dict(moved.headers)["Location"] == "./page?fixedDpr=1"
    request = asked("/page?fixedDpr=1")
    assert under_its_name(request) is None and request.path == "/?fixedDpr=1"
    assert under_its_name(asked("/")) is None
