"""Colours that are readable on light and dark backgrounds, the same in the scene, the lists and the plots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

RGB = tuple[int, int, int]

WHITE: RGB = (255, 255, 255)
BLACK: RGB = (0, 0, 0)
LIGHT_PAGE, DARK_PAGE = WHITE, (36, 36, 36)
"""Backgrounds of lists and plots. The 3D view is white in the light theme, and darker than the page in the
dark theme."""

BAD: RGB = (215, 38, 38)
GOOD: RGB = (22, 158, 100)
BOUND: RGB = (139, 149, 161)
GHOST: RGB = (124, 92, 230)
AXES: tuple[RGB, ...] = ((255, 32, 96), (32, 223, 128), (32, 128, 255))
"""The axes x, y and z: the colours of the arrows in viser's scene."""
DAMPING: RGB = BOUND
TARGET: RGB = (118, 152, 0)
"""The dragged target: no robot of the catalog, level or arrow has this colour."""

# Any two of these colours and BOUND differ by a CIEDE2000 of at least 10 for normal sight, deuteranopia and
# protanopia. Each has a contrast of at least 3 on both pages. tests/app/test_app_palette.py checks this.
_ORANGE: RGB = (226, 112, 0)  # the first level: texts of lessons call it orange
_BLUE: RGB = (48, 121, 240)  # the second level: texts of lessons call it blue
_GREEN: RGB = (37, 137, 100)
_MAGENTA: RGB = (231, 0, 198)
_ROSE: RGB = (255, 33, 114)
_TEAL: RGB = (2, 125, 153)
LEVELS: tuple[RGB, ...] = (_ORANGE, _BLUE, _GREEN, _MAGENTA, _ROSE, _TEAL)
JOINTS: tuple[RGB, ...] = (BAD, _ORANGE, _GREEN, _TEAL, _BLUE, _MAGENTA, _ROSE)
_DASHES: tuple[tuple[float, ...], ...] = ((), (12.0, 3.0), (12.0, 3.0, 2.0, 3.0))
"""Dashes and gaps of the curves of the first seven joints (solid), of the next seven, and so on. Joints that
share a colour have different patterns."""


def css(colour: RGB, alpha: float = 1.0) -> str:
    red, green, blue = colour
    return f"rgba({red},{green},{blue},{alpha:g})"


def level_colours(names: Sequence[str]) -> dict[str, RGB]:
    """Returns a colour per level name. A level keeps its colour when it moves up or down."""
    colours = {name: LEVELS[k % len(LEVELS)] for k, name in enumerate(names)}
    colours["damping"] = DAMPING
    return colours


def recoloured(names: Sequence[str], before: dict[str, RGB]) -> dict[str, RGB]:
    """Returns the colours of another stack. An existing level keeps its colour, and a new level takes the
    colour of a level with which it shares a task. The other levels get unused colours."""
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


def joint_dash(index: int) -> tuple[float, ...]:
    """Lengths, px, of the dashes and gaps in the curve of a joint; empty for a solid curve."""
    return _DASHES[index // len(JOINTS) % len(_DASHES)]


def contrast(one: RGB, other: RGB) -> float:
    """Returns the contrast ratio of WCAG 2.1, 1 … 21."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


def on(colour: RGB) -> RGB:
    """White or black, whichever is easier to read on the colour; its contrast is at least 4.58."""
    return max((WHITE, BLACK), key=lambda text: contrast(text, colour))


def button(colour: RGB) -> RGB:
    """Returns the colour, darkened until white text on a button of this colour is readable."""
    return next(found for found in _mixed(colour, BLACK) if contrast(found, WHITE) >= 4.6)


def ink(colour: RGB) -> str:
    """Returns the CSS colour of text in this colour, darker on a light page and lighter on a dark page."""
    light, dark = readable_on(colour, LIGHT_PAGE), readable_on(colour, DARK_PAGE)
    return f"light-dark({css(light)},{css(dark)})"


def readable_on(colour: RGB, page: RGB) -> RGB:
    """Returns the colour, mixed with black or white until its contrast with the page is at least 7.5. On pale
    areas and in paler paragraphs, the contrast is then at least 4.5."""
    return next(found for found in _mixed(colour, on(page)) if contrast(found, page) >= _TEXT)


def _mixed(colour: RGB, end: RGB) -> Iterator[RGB]:
    """The mixtures from the colour to `end`, in steps of a twentieth."""
    for share in range(21):
        r, g, b = (round(own + share / 20 * (to - own)) for own, to in zip(colour, end, strict=True))
        yield r, g, b


_TEXT = 7.5


def _luminance(colour: RGB) -> float:
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
