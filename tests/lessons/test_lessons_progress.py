"""A learner's submission of progress is read as it was written, its signature is checked, and it is refused
if damaged."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from app.commands.grade import grade
from lessons.replay.progress import (
    HandedIn,
    LearnerProgress,
    kept,
    load_progress,
    progress_from,
    read_handed_in,
    read_key,
    written,
)
from robots import InputError

KEY, OTHER = b"an instructor's key", b"somebody else's key"
DONE = LearnerProgress().with_step("deadlines", 0).with_step("deadlines", 2).with_points("one-task", 81.0)
HANDED = HandedIn("Zoë Ångström", "2026-11-22T10:00:00+00:00", DONE, "hl1-abc")


@pytest.mark.parametrize("key", [None, KEY])
def test_what_is_handed_in_is_read_as_it_was_written(key: bytes | None) -> None:
    text = written(HANDED, key)
    lines = "\n".join(text[at : at + 40] for at in range(0, len(text), 40))
    assert read_handed_in(lines, key) == (HANDED, "not signed" if key is None else "signed")


def test_a_signature_is_of_one_key() -> None:
    assert read_handed_in(written(HANDED, OTHER), KEY) == (HANDED, "signed with another key")
    assert read_handed_in(written(HANDED, KEY), None) == (HANDED, "not signed")
    assert read_handed_in(written(HANDED, None), KEY) == (HANDED, "not signed")


def test_what_was_changed_is_not_signed() -> None:
    """A better score with the signature of a worse one is not accepted, and neither is any change of a single
    character."""
    better = HandedIn(HANDED.name, HANDED.at, DONE.with_points("deadlines", 100.0))
    seal = written(HANDED, KEY)[-64:]
    assert read_handed_in(written(better, KEY)[:-64] + seal, KEY)[1] == "signed with another key"
    text = written(HANDED, KEY)
    for at in range(0, len(text), 7):
        changed = text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :]
        with suppress(InputError):
            assert read_handed_in(changed, KEY)[1] != "signed"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not a text that the page wrote"),
        ("hello", "not a text that the page wrote"),
        (written(HANDED, None)[:-1], "not a text that the page wrote"),
        ("x" * 10**6, "not a text that the page wrote"),
        (written(HANDED, None).replace("hp1-", "hp9-"), "format 9"),
        (written(HANDED, None)[:-1] + "g", "not a text that the page wrote"),
        ("hp1-AAAA-" + "0" * 64, "incomplete or was changed"),
        ("hp1s-AAAA-" + "0" * 64, "incomplete or was changed"),
    ],
)
def test_damage_to_what_is_handed_in_is_a_sentence(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_handed_in(text, KEY)


def test_the_account_is_signed_with_the_progress() -> None:
    """The text names the account that the proxy reported. The data that the browser of one account stored are
    not accepted for another account, and not by a lab without accounts."""
    text = written(replace(HANDED, account="zoe"), KEY)
    handed, proof = read_handed_in(text, KEY)
    assert (handed.account, proof) == ("zoe", "signed")
    stored = kept(DONE, KEY, "zoe")
    assert load_progress(stored, KEY, "zoe") == DONE
    for account in ("ben", "", "zo"):
        assert load_progress(stored, KEY, account) == LearnerProgress()
    assert load_progress(kept(DONE, KEY), KEY, "zoe") == LearnerProgress()


def test_the_command_says_whether_an_account_is_proven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key, file = tmp_path / "key", tmp_path / "zoe.txt"
    key.write_bytes(KEY)
    file.write_text(written(replace(HANDED, account="zoe"), KEY))
    assert grade(file, key=str(key)) == 0
    assert "account: zoe\n" in capsys.readouterr().out
    assert grade(file) == 0
    assert "account: zoe, which is not proven" in capsys.readouterr().out


def test_a_lab_with_a_key_believes_only_what_it_wrote_into_the_browser() -> None:
    assert load_progress(kept(DONE, KEY), KEY) == DONE
    assert load_progress(kept(DONE, None), None) == DONE
    forged = kept(DONE, KEY)[:64] + DONE.with_points("deadlines", 100.0).dumped()
    for text in (None, "", "{", DONE.dumped(), kept(DONE, OTHER), forged, "ü" * 200):
        assert load_progress(text, KEY) == LearnerProgress()
    assert progress_from(kept(DONE, KEY)) == LearnerProgress()


def test_grade_reads_what_is_handed_in(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, key, out = tmp_path / "zoe.txt", tmp_path / "key", tmp_path / "a.json"
    file.write_text(written(HANDED, KEY) + "\n")
    key.write_bytes(KEY + b"\n")
    assert grade(file, key=str(key), json=str(out)) == 0
    found_data = json.loads(out.read_text())
    assert (found_data["name"], found_data["proof"]) == (HANDED.name, "signed")
    steps = {each["lesson"]: (each["steps"], each["score"]) for each in found_data["lessons"]}
    assert steps == {"deadlines": ([1, 3], None), "one-task": ([], 81.0)}
    assert grade(file) == 0
    assert "signature not checked" in capsys.readouterr().out
    key.write_bytes(OTHER)
    assert grade(file, key=str(key)) == 1
    assert "signed with another key" in capsys.readouterr().out
    file.write_text("hp1-")
    with pytest.raises(InputError, match=r"zoe\.txt: this is not a text that the page wrote"):
        grade(file)
    with pytest.raises(InputError, match=r"nobody\.txt: cannot be read"):
        grade(tmp_path / "nobody.txt")
    key.write_bytes(b"short")
    with pytest.raises(InputError, match="a key has 16 characters or more"):
        read_key(str(key))
