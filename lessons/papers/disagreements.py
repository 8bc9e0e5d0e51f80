"""Makes the page "Where we disagree with the papers" from the reproduced numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from lessons.papers.item import Row
from lessons.papers.stored import stored
from lessons.papers.topics import Measured, Topic, topics
from lessons.papers.words import number
from lessons.replay.state import encode

ComparedRows = Sequence[tuple[str, Row]]
"""(name of the item, row)."""

_INTRO = """\
# Where we disagree with the papers

Written by `himpc-lab reproduce`; `himpc-lab reproduce --stored` writes it from the stored numbers, without
a run. HIMPC is Wang, Liu, Leibold, Buss, Lee, T-RO 2024; HTMPC is Du, Zhou, Schoellig, RA-L 2024.

{tally}

HIMPC's paper prints neither its plants (masses, friction, how a velocity is measured) nor its code. HTMPC's
paper prints neither its weights (ours are from the authors' published set-up) nor its targets. So if two
numbers differ, neither of them need be wrong, but the difference must have a reason that can be examined.
Here is every row that does not agree within its tolerance (10 % if none is named), ordered by what we think
is the cause. *Opposite* means that an effect has the other direction. `reproduce` also fails if a
disagreement shrinks or vanishes and this page is not changed. Every number of ours, in the tables and in the
texts below them, is measured by `reproduce` and compared with the stored number.
"""
_NO_TOPIC = Topic("", "Not explained yet", "none.", "not known.", "run the item.")


def page(compared: ComparedRows) -> str:
    """Returns the page in Markdown.

    Args:
        compared: every row of the items.
    """
    by_topic: dict[str, list[tuple[str, Row]]] = {name: [] for name in topics()}
    for item, row in compared:
        if row.verdict not in ("differs", "opposite"):
            continue
        by_topic.setdefault(row.topic if row.topic in topics() else "", []).append((item, row))
    parts = [_INTRO.format(tally=_tally([row for _, row in compared]))]
    measured = {**_remembered(), **{(item, row.quantity): (row.ours, row.ratio) for item, row in compared}}
    parts += [
        _section(topics().get(name, _NO_TOPIC).with_numbers(measured), rows)
        for name, rows in by_topic.items()
        if rows
    ]
    return "\n".join(parts)


def _remembered() -> Measured:
    """Returns the stored numbers. They replace the numbers that a short reproduction does not measure."""
    return {
        (item, quantity): (ours, ratio)
        for item, memory in stored(False).items()
        for quantity, (ours, ratio, *_) in memory.rows.items()
    }


def _tally(rows: Sequence[Row]) -> str:
    counts = Counter(row.verdict for row in rows)
    compared = sum(counts[verdict] for verdict in ("agrees", "differs", "opposite"))
    copied = sum(row.copied and row.verdict == "agrees" for row in rows)
    return (
        f"Of {compared} comparisons with numbers and statements of the papers, {counts['agrees']} agree, "
        f"{counts['differs']} differ and {counts['opposite']} are opposite. A printed number counts once for "
        f"each of our readings of it. Of the comparisons that agree, {copied} are settings that we copied "
        "from the papers."
    )


def _section(topic: Topic, rows: ComparedRows) -> str:
    lines = [
        f"## {topic.title}",
        "",
        "| item | what | unit | paper | ours | ratio | verdict |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *(_line(item, row) for item, row in rows),
        "",
        f"**Our evidence.** {_flat(topic.evidence)}",
        "",
        f"**Likely cause.** {_flat(topic.cause)}",
        "",
        f"**See it.** {_flat(topic.look)}",
    ]
    if topic.state is not None:
        lines += [
            "",
            "```sh",
            topic.state.run.command_line(),
            f"himpc-lab --state {encode(topic.state)}",
            "```",
        ]
    return "\n".join((*lines, ""))


def _line(item: str, row: Row) -> str:
    paper = {"below": "smaller", "above": "larger", "about": "about equal"}.get(row.says or "")
    cells = (
        f"`{item}`",
        row.quantity,
        row.unit,
        paper or number(row.paper),
        number(row.ours),
        number(row.ratio),
        row.verdict,
    )
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def _flat(text: str) -> str:
    return " ".join(text.split())
