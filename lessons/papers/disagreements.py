"""The page "Where we disagree with the papers", made from what was reproduced."""

from __future__ import annotations

from collections.abc import Sequence

from lessons.papers.item import Row
from lessons.papers.topics import Topic, topics
from lessons.papers.words import number
from lessons.replay.state import encode

Found = Sequence[tuple[str, Row]]
"""(name of the item, row)."""

_INTRO = """\
# Where we disagree with the papers

Written by `himpc-lab reproduce`; `himpc-lab reproduce --stored` writes it from the stored numbers, without
a run. HIMPC is Wang, Liu, Leibold, Buss, Lee, T-RO 2024; HTMPC is Du, Zhou, Schoellig, RA-L 2024.

{tally}

Neither paper prints its plant (masses, friction, how a velocity is measured) or its code. So a number that
differs need not be wrong, neither theirs nor ours; but each must have a reason that can be looked at. Here
is every row that does not agree within its tolerance, 10 % where none is named, ordered by what we think is
the cause. *Opposite* means that an effect has the other direction. `reproduce` judges each row on both
sides: it also fails if a disagreement shrinks or vanishes without this page being changed. Numbers in the
tables are measured anew by every `reproduce`; those in the texts below them were measured once, by the
settings named with them.
"""
_NO_TOPIC = Topic("", "Not explained yet", "none.", "not known.", "run the item.")


def page(found: Found) -> str:
    """The page in Markdown.

    Args:
        found: every row of the items.
    """
    by_topic: dict[str, list[tuple[str, Row]]] = {name: [] for name in topics()}
    for item, row in found:
        if row.verdict not in ("differs", "opposite"):
            continue
        by_topic.setdefault(row.topic if row.topic in topics() else "", []).append((item, row))
    verdicts = [row.verdict for _, row in found]
    counts = {each: verdicts.count(each) for each in ("agrees", "differs", "opposite")}
    tally = (
        f"Of {sum(counts.values())} printed numbers and statements that we hold ours against, "
        f"{counts['agrees']} agree, {counts['differs']} differ and {counts['opposite']} come out the other "
        "way round."
    )
    parts = [_INTRO.format(tally=tally)]
    parts += [_section(topics().get(name, _NO_TOPIC), rows) for name, rows in by_topic.items() if rows]
    return "\n".join(parts)


def _section(topic: Topic, rows: Found) -> str:
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
