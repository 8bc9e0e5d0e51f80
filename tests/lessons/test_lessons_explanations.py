"""Every sentence that gives a reason is tested: an intervention quotes it, the sentence says that the reason
is given, or it is exempt by name, together with the test that checks it instead."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from functools import cache

from explanations import DOCUMENTS, ROOT, causal, passages, sentences
from explanations_exempt import TEXTS, Exempt
from explanations_reference import REFERENCE
from interventions import Intervention
from interventions_all import ROWS
from quoted_all import QUOTED

from docs.pages import texts
from lessons.course import COURSE, load_lesson
from lessons.papers.topics import topics

EXEMPT = (*TEXTS, *REFERENCE)
Told = list[tuple[str, str]]


@cache
def walked() -> Told:
    """Returns (place, text) of all texts."""
    return list(passages())


@cache
def told() -> Told:
    """Returns (place, sentence) of all sentences that give a reason."""
    return list(dict.fromkeys((place, each) for place, text in walked() for each in causal(text)))


def left(found: Told, rows: Iterable[Intervention], exempt: Iterable[Exempt]) -> Told:
    """Returns the sentences that no row quotes and no exemption names."""
    quoted: dict[str, list[str]] = {}
    for row in rows:
        quoted.setdefault(row.at, []).append(row.says)
    named = [each for group in exempt for each in group.sentences]
    return [
        (place, sentence)
        for place, sentence in found
        if not any(says in sentence or sentence in says for says in quoted.get(place, ()))
        and not any(place == at and sentence.startswith(begins) for at, begins in named)
    ]


def test_every_reason_is_held() -> None:
    assert left(told(), ROWS, EXEMPT) == []


def test_a_reason_whose_row_is_missing_is_found() -> None:
    """If the only row that quotes a sentence is removed, the test reports the sentence."""
    says = "because by then the torques had changed so as to push back"
    (lost,) = left(told(), [row for row in ROWS if row.says != says], EXEMPT)
    assert lost[0] == "one-task/0" and says in lost[1]
    (more,) = left([*told(), ("README", "It is fast because it is red.")], ROWS, EXEMPT)
    assert more[0] == "README"


def test_no_exemption_is_left_over() -> None:
    """Each exemption names an existing sentence that no row quotes."""
    named = [each for group in EXEMPT for each in group.sentences]
    assert len(set(named)) == len(named)
    unheld = left(told(), ROWS, ())
    idle = [
        (at, begins)
        for at, begins in named
        if not any(place == at and sentence.startswith(begins) for place, sentence in unheld)
    ]
    assert idle == []


def test_an_exemption_names_the_test_that_holds_it() -> None:
    for group in EXEMPT:
        assert bool(group.held_by) == (group.kind in ("mathematics", "measured", "software")), group
        if group.kind == "purpose":
            assert all(at.endswith(".py") for at, _ in group.sentences), group
        if group.held_by:
            file, name = group.held_by.split("::")
            tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
            assert name in {each.name for each in tree.body if isinstance(each, ast.FunctionDef)}, (
                group.held_by
            )


def test_every_step_is_measured_beyond_its_claims() -> None:
    """For each step there is a row of the interventions, a number that is quoted, or a separate test."""
    named = {at for group in EXEMPT if group.held_by for at, _ in group.sentences}
    held = named | {row.at for row in ROWS} | {each.step for each in QUOTED}
    steps = {f"{name}/{k}" for name in COURSE for k in range(len(load_lesson(name).steps))}
    assert steps - held == set()


def test_every_likely_cause_is_held_or_not_known() -> None:
    """On the page of disagreements, a run tests each likely cause, or the text says that it is not known."""
    own = ("The cost (41) contains", "The rule for the arrival of the base.")
    for name, topic in topics().items():
        cause = " ".join(topic.cause.split())
        held = any(row.says in cause for row in ROWS if row.at == "disagreements")
        assert held or cause.startswith(("Not known", "Not measured here", *own)), name


def test_the_walk_reaches_every_page_of_the_site() -> None:
    """The texts include the documents of the site, and each of these words counts as a reason."""
    assert set(texts.IN_DOCS) <= set(DOCUMENTS)
    assert all((ROOT / file).exists() for file in DOCUMENTS.values())
    places = {place.split("/")[0] for place, _ in walked()}
    assert places >= {"further", "exercise", "glossary", "robots", "himpc", "lessons", "app", "examples"}
    for reason in (
        "because a",
        "since it",
        "; so it",
        "so that it",
        "due to it",
        "That is why it",
        "leads to it",
    ):
        assert causal(f"It is fast {reason} is red."), reason
    assert not causal("It was so far so good since the start, given, not measured, because of it.")
    assert sentences("One. Two, i.e. this. | Three |\n\nFour `code`. $x$ is five.") == [
        "One.", "Two, i.e. this.", "Three", "Four `code`.", "$x$ is five.",
    ]  # fmt: skip
