"""The progress that a learner handed in, as `himpc-lab grade` prints it."""

from __future__ import annotations

from pathlib import Path

from app.commands.output import print_table, write_json
from robots import InputError

TEXTS = (".txt", ".text", "")
"""Extensions of files that may contain a learner's progress as text."""


def handed_in(file: Path, key: str | None, json: str | None) -> int:
    """Prints the progress that a learner handed in, and whether a lab with the key signed it."""
    from app.link.exercise import parts_of
    from lessons.course import COURSE, load_lesson
    from lessons.replay.progress import read_handed_in, read_key

    try:
        if not file.is_file():  # reading a named pipe would wait for ever
            raise OSError
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise InputError(f"{file}: cannot be read as text; give the file that the page exported") from None
    try:
        handed, proof = read_handed_in(text, None if key is None else read_key(key))
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    progress = handed.progress
    lessons = [
        {
            "lesson": name,
            "steps": [place + 1 for place in sorted(progress.seen.get(name, ()))],
            "of": len(parts_of(load_lesson(name))),
            "score": progress.best.get(name),
        }
        for name in COURSE
        if name in progress.seen or name in progress.best
    ]
    if json is not None:
        said = {"name": handed.name, "account": handed.account, "at": handed.at, "proof": proof}
        write_json({**said, "code": handed.code, "lessons": lessons}, json)
    else:
        rows = [
            [str(each["lesson"]), f"{len(each['steps'])} of {each['of']}", _score(each["score"])]
            for each in lessons
        ]
        print_table(f"{handed.name or 'nobody'}, {handed.at}", ("lesson", "steps run", "best score"), rows)
        print(_SAYS[proof] if key else _NOT_JUDGED)
        if handed.account:
            known = key is not None and proof == "signed"
            print(f"account: {handed.account}" + ("" if known else ", which is not proven"))
        if handed.code:
            print(f"setting on the page then: himpc-lab --state {handed.code}")
    return 0 if key is None or proof == "signed" else 1


def _score(points: float | None) -> str:
    return "–" if points is None else f"{points:.0f}"


_SAYS = {
    "signed": "signed by a lab with your key",
    "not signed": "not signed: anybody could have written it",
    "signed with another key": "signed with another key, or changed",
}
_NOT_JUDGED = "signature not checked: give the key of your lab with --key FILE"
