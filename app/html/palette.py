"""Colours that are readable on light and dark backgrounds, the same in the scene, the lists and the plots."""

from __future__ import annotations

from collections.abc import Sequence

RGB = tuple[int, int, int]

LEVELS: tuple[RGB, ...] = (
    (240, 130, 20),  # orange: the colour that the first sentence of the page names
    (59, 130, 246),
    (22, 163, 104),
    (168, 85, 247),
    (225, 29, 116),
    (13, 148, 150),
)
DAMPING: RGB = (139, 149, 161)
JOINTS: tuple[RGB, ...] = (
    (230, 75, 60),
    (240, 150, 20),
    (90, 170, 50),
    (20, 160, 160),
    (59, 130, 246),
    (140, 90, 240),
    (215, 70, 160),
    (140, 110, 80),
    (110, 125, 140),
)
BAD: RGB = (225, 45, 45)
GOOD: RGB = (22, 163, 104)
BOUND: RGB = (139, 149, 161)
GHOST: RGB = (124, 92, 230)


def css(colour: RGB, alpha: float = 1.0) -> str:
    red, green, blue = colour
    return f"rgba({red},{green},{blue},{alpha:g})"


def level_colours(names: Sequence[str]) -> dict[str, RGB]:
    """A colour per level name. A level keeps its colour when it moves up or down."""
    colours = {name: LEVELS[k % len(LEVELS)] for k, name in enumerate(names)}
    colours["damping"] = DAMPING
    return colours


def recoloured(names: Sequence[str], before: dict[str, RGB]) -> dict[str, RGB]:
    """The colours of another stack: an existing level keeps its colour, and so does a level that shares a
    task with it; the others get unused colours."""
    found: dict[str, RGB] = {}
    for name in names:
        tasks = set(name.split("+"))
        kept = [before[name]] if name in before else []
        kept += [colour for level, colour in before.items() if tasks & set(level.split("+"))]
        free = [colour for colour in LEVELS if colour not in found.values()]
        unused = [colour for colour in free if colour not in before.values()]
        own = [colour for colour in kept if colour in free]
        found[name] = (own or unused or free or list(LEVELS))[0]
    found["damping"] = DAMPING
    return found


def joint_colour(index: int) -> RGB:
    return JOINTS[index % len(JOINTS)]
