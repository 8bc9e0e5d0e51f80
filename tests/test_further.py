"""The equations of the site's derivations hold, and the numbers in the answers to its questions are
computed."""

from __future__ import annotations

import re

import numpy as np
import pytest
from latex2mathml.converter import convert

from docs.further import further
from docs.further.kit import Question
from lessons.course import COURSE, load_lesson

QUESTIONS = [(name, k) for name in COURSE for k in range(3)]
_NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?")


def question(name: str, k: int) -> Question:
    return further(name).questions[k]


@pytest.mark.parametrize("name", COURSE)
def test_every_lesson_derives_something(name: str) -> None:
    assert len(further(name).derivation) >= 3
    assert len(further(name).questions) == 3


@pytest.mark.parametrize("name", COURSE)
def test_the_equations_hold(name: str) -> None:
    """Both sides of every equation are equal for several sets of random numbers."""
    for place, each in enumerate(further(name).derivation):
        for seed in range(5):
            left, right = each.sides(np.random.default_rng(seed))
            left, right = np.asarray(left, float), np.asarray(right, float)
            assert left.shape == right.shape and np.isfinite(left).all(), place
            np.testing.assert_allclose(
                left, right, rtol=each.tolerance, atol=each.tolerance, err_msg=str(place)
            )


@pytest.mark.parametrize(("name", "k"), QUESTIONS)
def test_an_answer_computes_its_numbers(name: str, k: int) -> None:
    """A number in an answer is computed, given in the question or the lesson, or a count below ten."""
    asked = question(name, k)
    lesson = load_lesson(name)
    given = asked.asked + "".join(step.text + step.why for step in lesson.steps)
    given += lesson.challenge.text if lesson.challenge else ""
    known = set(_NUMBER.findall(given))
    literal = re.sub(r"10\^\{?-?\d+\}?|\^\{?-?\d+\}?|_\{?\d+\}?|\(\d+[a-z]?\)|⟨\w+⟩", " ", asked.answer)
    for number in _NUMBER.findall(literal):
        small = number.isdigit() and int(number) < 10
        plain = re.search(rf"{re.escape(number)} to 1\b", asked.answer)
        assert small or plain or number in known, f"{number} in: {asked.answer}"
    assert "⟨" not in asked.answered and "nan" not in asked.answered
    assert all(f"⟨{hole}⟩" in asked.answer for hole in asked.numbers)


@pytest.mark.parametrize("name", COURSE)
def test_texts_can_be_rendered(name: str) -> None:
    """Dollar signs come in pairs, and the text between them is LaTeX."""
    own = further(name)
    texts = [each.words for each in own.derivation]
    texts += [text for each in own.questions for text in (each.asked, each.answered)]
    for text in texts:
        assert text.count("$") % 2 == 0, text
        assert not re.search(r"[\x00-\x09\x0b-\x1f]", text), text
        for inline in re.findall(r"\$(.+?)\$", text, re.DOTALL):
            assert "<math" in convert(inline)
    for each in own.derivation:
        assert "<math" in convert(each.equation, display="block")
