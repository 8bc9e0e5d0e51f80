"""The colours of levels and joints differ for normal sight, deuteranopia and protanopia, and can be seen and
read on the light and on the dark page.

Differences are CIEDE2000 (the distance between two colours as people judge it) and, beside it, the older
ΔE*ab of 1976. Colour vision deficiencies are simulated by Machado, Oliveira and Fernandes (2009) at severity
1.0. Contrast is that of WCAG 2.1: at least 3 for graphics (1.4.11), 4.5 for text (1.4.3).
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence

import pytest
from coloraide import Color

from app.html.palette import (
    BAD,
    BOUND,
    DARK_PAGE,
    GHOST,
    GOOD,
    JOINTS,
    LEVELS,
    LIGHT_PAGE,
    RGB,
    TARGET,
    button,
    contrast,
    ink,
    joint_colour,
    joint_dash,
    on,
)
from app.html.text import badge
from app.panels.widgets.chart import ChartLine

SIGHTS = ("normal", "deutan", "protan")


def seen(colour: RGB, sight: str) -> Color:
    colour_seen = Color("srgb", [value / 255 for value in colour])
    if sight != "normal":
        colour_seen = colour_seen.filter(sight, 1.0, method="machado").convert("srgb").clip()
    return colour_seen


def least(colours: Sequence[RGB], method: str = "2000") -> tuple[float, str, RGB, RGB]:
    """Returns the smallest difference of all pairs, with the kind of sight and the pair."""
    return min(
        (seen(one, sight).delta_e(seen(other, sight), method=method), sight, one, other)
        for sight in SIGHTS
        for one, other in itertools.combinations(colours, 2)
    )


@pytest.mark.parametrize("method", ["2000", "76"])
@pytest.mark.parametrize("colours", [(*LEVELS, BOUND), (*JOINTS, BOUND), (BAD, GOOD)])
def test_each_pair_of_colours_differs_by_ten_for_each_sight(colours: tuple[RGB, ...], method: str) -> None:
    assert least(colours, method)[0] >= 10.0


@pytest.mark.parametrize("page", [LIGHT_PAGE, DARK_PAGE])
@pytest.mark.parametrize("colour", [*LEVELS, *JOINTS, BAD, GOOD, GHOST, BOUND, TARGET])
def test_curves_and_marks_stand_out_from_the_page(colour: RGB, page: RGB) -> None:
    assert contrast(colour, page) >= 3.0


@pytest.mark.parametrize("colour", [*LEVELS, *JOINTS, BAD, GOOD, GHOST, BOUND, TARGET])
def test_text_in_a_colour_can_be_read_on_both_pages(colour: RGB) -> None:
    found = [tuple(map(int, rgb)) for rgb in re.findall(r"rgba\((\d+),(\d+),(\d+),1\)", ink(colour))]
    assert ink(colour).startswith("light-dark(")
    for (r, g, b), page in zip(found, (LIGHT_PAGE, DARK_PAGE), strict=True):
        assert contrast((r, g, b), page) >= 4.5
        paler = tuple(round(0.8 * own + 0.2 * behind) for own, behind in zip((r, g, b), page, strict=True))
        assert contrast((paler[0], paler[1], paler[2]), page) >= 4.5, "in a paragraph with opacity 0.8"
    assert contrast(on(colour), colour) >= 4.5
    assert contrast(button(colour), LIGHT_PAGE) >= 4.5, "white words on a button"
    assert f"color:rgba({on(colour)[0]}," in badge("word", colour)


@pytest.mark.parametrize("colour", [*LEVELS, BAD, (255, 255, 255), (0, 0, 0)])
def test_contrast_is_that_of_a_library(colour: RGB) -> None:
    for page in (LIGHT_PAGE, DARK_PAGE):
        theirs = seen(colour, "normal").contrast(seen(page, "normal"), method="wcag21")
        assert contrast(colour, page) == pytest.approx(theirs, rel=1e-3)


def test_joints_that_share_a_colour_have_other_dashes() -> None:
    looks = {(joint_colour(k), joint_dash(k)) for k in range(21)}
    assert len(looks) == 21
    lines = [ChartLine(f"joint {k + 1}", joint_colour(k), dash=joint_dash(k)) for k in range(21)]
    drawn = {(line.colour, line.dash) for each in lines for line in (each, each.of_ghost())}
    assert len(drawn) == 42, "a ghost's curve looks different from every curve of the robot"
