"""The progress of a learner: in the form that the browser stores, and as a text to hand in.

With the key of an instructor's lab, both contain an HMAC of their content: everybody who has the key can
verify that a lab with the same key wrote them. Without a key they contain a checksum that only detects
damage.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import json
import math
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from lessons.course import COURSE
from robots import InputError

VERSION = 1
LONGEST_NAME = 80
LEAST_KEY = 16  # bytes
_LONGEST_TEXT = 200_000
_HANDED = re.compile(r"hp(\d{1,6})(s?)-([\w-]+)-([0-9a-f]{64})")
Proof = Literal["signed", "not signed", "signed with another key"]


@dataclass(frozen=True)
class LearnerProgress:
    """The steps whose run a learner has seen, and the points of challenges.

    Attributes:
        seen: per lesson the indices of the steps whose run was seen.
        best: per lesson the best points (0 to 100) of its challenge.
    """

    seen: Mapping[str, frozenset[int]] = field(default_factory=dict)
    best: Mapping[str, float] = field(default_factory=dict)

    def with_step(self, lesson: str, step: int) -> LearnerProgress:
        """Returns the progress after the run of a step."""
        return replace(self, seen={**self.seen, lesson: self.seen.get(lesson, frozenset()) | {step}})

    def with_points(self, lesson: str, points: float) -> LearnerProgress:
        """Returns the progress after a challenge was passed; only the best attempt counts."""
        return replace(self, best={**self.best, lesson: max(points, self.best.get(lesson, 0.0))})

    def next_step(self, lesson: str, steps: int) -> int:
        """Returns the first step that was not seen; 0 if all steps were seen."""
        seen = self.seen.get(lesson, frozenset())
        return next((step for step in range(steps) if step not in seen), 0)

    def dumped(self) -> str:
        """Returns the progress as text."""
        return json.dumps(
            {"seen": {name: sorted(steps) for name, steps in self.seen.items()}, "best": dict(self.best)}
        )


def kept(progress: LearnerProgress, key: bytes | None, account: str = "") -> str:
    """Returns the progress in the form that the browser stores. account: the name with which the learner
    signed in; a key signs this name, too."""
    text = progress.dumped()
    return text if key is None else _seal(_of(account, text), key) + text


def load_progress(text: str | None, key: bytes | None, account: str = "") -> LearnerProgress:
    """Returns the progress that a browser stored. With a key, only progress that is signed with it for this
    account counts."""
    if key is None or not text:
        return progress_from(text)
    seal, body = text[:64], text[64:]
    return progress_from(
        body if hmac.compare_digest(seal.encode(), _seal(_of(account, body), key).encode()) else None
    )


def _of(account: str, text: str) -> bytes:
    return (f"{account}\0{text}" if account else text).encode()


def progress_from(text: str | None) -> LearnerProgress:
    """Reads the browser's storage, which anybody may have written; invalid entries are left out."""
    try:
        data = json.loads(text or "{}")
    except (ValueError, RecursionError):
        return LearnerProgress()
    if not isinstance(data, dict):
        return LearnerProgress()
    return LearnerProgress(
        {
            name: frozenset(step for step in steps if type(step) is int and 0 <= step < 100)
            for name, steps in _of_lessons(data.get("seen"))
            if isinstance(steps, list)
        },
        {
            name: float(points)
            for name, points in _of_lessons(data.get("best"))
            if type(points) in (int, float) and math.isfinite(points) and 0 <= points <= 100
        },
    )


def _of_lessons(data: Any) -> list[tuple[str, Any]]:
    return [(name, data[name]) for name in COURSE if name in data] if isinstance(data, dict) else []


# ------------------------------------------------------------------ handed in


@dataclass(frozen=True)
class HandedIn:
    """The text that a learner hands in, as data.

    Attributes:
        name: name of the learner, as the learner wrote it.
        at: time, ISO 8601.
        progress: progress in the lessons.
        code: state code of the setting on the page at that time; "" if none could be made.
        account: the name with which the learner signed in, as reported by the proxy in front of the lab; ""
            if there was none.
    """

    name: str
    at: str
    progress: LearnerProgress
    code: str = ""
    account: str = ""


def written(handed: HandedIn, key: bytes | None) -> str:
    """Returns the text that a learner hands in; it has only letters, digits, "-" and "_"."""
    data = {"n": handed.name[:LONGEST_NAME], "t": handed.at, "p": handed.progress.dumped(), "c": handed.code}
    data |= {"a": handed.account} if handed.account else {}
    body = base64.urlsafe_b64encode(zlib.compress(json.dumps(data, ensure_ascii=False).encode(), 9))
    text = f"hp{VERSION}{'s' if key is not None else ''}-{body.decode().rstrip('=')}"
    return f"{text}-{_seal(text.encode(), key)}"


def read_handed_in(text: str, key: bytes | None) -> tuple[HandedIn, Proof]:
    """Reads a text that was handed in, and checks its signature or checksum. Without a key a signature cannot
    be checked, and the text counts as not signed.

    Raises:
        InputError: the text is of another kind, incomplete or damaged, or was written by a newer version.
    """
    matched = _HANDED.fullmatch("".join(text.split())) if len(text) <= _LONGEST_TEXT else None
    if matched is None:
        raise InputError(
            f"this is not a text that the page wrote: such a text begins with hp{VERSION}- or hp{VERSION}s- "
            "and ends with 64 digits and letters; copy all of it"
        )
    version, signed, body, seal = matched.groups()
    if int(version) != VERSION:
        raise InputError(f"the text has format {version}, this himpc-lab reads {VERSION}: update himpc-lab")
    whole = f"hp{version}{signed}-{body}".encode()
    if not signed and not hmac.compare_digest(seal, _seal(whole, None)):
        raise _damaged()
    try:
        unpacking = zlib.decompressobj()
        packed = unpacking.decompress(base64.urlsafe_b64decode(body + "=" * (-len(body) % 4)), _LONGEST_TEXT)
        data = json.loads(packed.decode())
        name, at, progress, code = (str(data[key]) for key in "ntpc")
    except (ValueError, binascii.Error, zlib.error, RecursionError, KeyError, TypeError):
        raise _damaged() from None
    account = _plain(str(data["a"]))[:LONGEST_NAME] if "a" in data else ""
    name, at = _plain(name)[:LONGEST_NAME], _plain(at)[:40]
    handed = HandedIn(name, at, progress_from(progress), code[:20_000], account)
    if not signed or key is None:
        return handed, "not signed"
    right = hmac.compare_digest(seal, _seal(whole, key))
    return handed, "signed" if right else "signed with another key"


def read_key(path: str) -> bytes:
    """Reads the key of a file, without blanks at its ends. Raises InputError if it cannot be read or is too
    short."""
    try:
        key = Path(path).read_bytes().strip()
    except OSError as error:
        raise InputError(f"--key {path}: cannot be read ({error.strerror})") from None
    if len(key) < LEAST_KEY:
        raise InputError(
            f"--key {path}: a key has {LEAST_KEY} characters or more; make one with "
            "python -c 'import secrets; print(secrets.token_hex())'"
        )
    return key


def _seal(data: bytes, key: bytes | None) -> str:
    return (hashlib.sha256(data) if key is None else hmac.new(key, data, "sha256")).hexdigest()


def _plain(text: str) -> str:
    return "".join(sign if sign.isprintable() else " " for sign in text)


def _damaged() -> InputError:
    return InputError("the text is incomplete or was changed: copy all of it again")
