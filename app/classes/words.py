"""The messages that the pages of a class may send; all others are refused."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import urlsplit

import msgspec
from msgspec import Meta

LONGEST = 2000
"""Largest size of a message, B."""
TEACHER = "class"
"""The name of the teacher's page in an address."""

PHONES = "/v/"
"""The beginning of the address at which phones vote; the code of the class follows."""
ONLY_HERE = (
    "Phones cannot reach this address, which only this computer can open: start himpc-lab again with "
    "--host 0.0.0.0."
)
TABLE = f"/{TEACHER}.csv"
"""The address of the table."""


def is_of_a_class(path: str) -> bool:
    """Returns whether an address belongs to a class."""
    plain = urlsplit(path).path
    return plain in (f"/{TEACHER}", TABLE) or plain.startswith(PHONES)


Short = Annotated[str, Meta(max_length=100)]
Number = Annotated[float, Meta(ge=-1e12, le=1e12)]


class Hello(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="hello"):
    """A phone's first message. seat: the seat that the phone got at an earlier visit."""

    seat: Short = ""


class CastVote(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="vote"):
    """A vote: the index of an option, or a number."""

    answer: int | Number


class TypedName(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="name"):
    """The name that a person typed."""

    name: Short


class GoTo(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="go"):
    """The step that the teacher chose; place: 0 for the first step."""

    lesson: Short
    place: Annotated[int, Meta(ge=0, le=1000)]


class Press(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="press"):
    """The teacher pressed a button: open, close, run or back."""

    button: Short


class SetClass(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="set"):
    """The teacher's settings of the class, see `app.classes.gathering.Gathering`."""

    stays: bool
    everywhere: bool


class OpenState(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="state"):
    """The number of the member whose state the teacher opens."""

    number: Annotated[int, Meta(ge=0, le=2**31)]


class Here(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="here"):
    """The address of the teacher's page, without its query; empty if it is only valid on the teacher's
    machine."""

    address: Annotated[str, Meta(max_length=300)]


OfPhone = Hello | CastVote | TypedName
OfTeacher = GoTo | Press | SetClass | OpenState | Here

of_phone = msgspec.json.Decoder(OfPhone)
of_teacher = msgspec.json.Decoder(OfTeacher)
