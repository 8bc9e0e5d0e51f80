"""Holds joints that are not controlled: those that a user names, and those that do not move the tip if too
many joints move."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from lxml.etree import _Element as Element

from robots.errors import InputError, shortened, unknown_name
from robots.report import Finding
from robots.urdf.joints import freeze
from robots.urdf.read import end_of, label, named
from robots.urdf.structure import chains, followers, movable_joints, parent_joints, resting
from robots.urdf.tip import not_legs

MAX_JOINTS = 20
"""Largest number of moving joints. With this number, a tick with three levels takes 0.4 ms of the control
period of 1 ms."""
_EXAMPLE = "a pattern describes a whole name, such as '.*{}.*'"


def held_by_name(root: Element, patterns: tuple[str, ...]) -> dict[str, tuple[float, str]]:
    """Returns the moving joints that the patterns "REGEX" and "REGEX=VALUE" hold, as name → (value, reason);
    the value is in rad or m; without one, it is that of the file's home, or 0. If several patterns fit a
    joint, the last is used.

    Raises InputError for a pattern that is not a regular expression, or that is the whole name of no moving
    joint.
    """
    joints = {joint.get("name", ""): joint for joint in (*movable_joints(root), *followers(root))}
    held: dict[str, tuple[float, str]] = {}
    for text in patterns:
        pattern, value = _parts(text)
        try:
            found = [name for name in joints if re.fullmatch(pattern, name)]
        except (re.error, OverflowError, RecursionError) as error:
            raise InputError(
                f"The pattern '{shortened(pattern)}' of joints to hold is not a regular expression: {error}."
            ) from None
        if not found:
            example = _EXAMPLE.format(shortened(pattern, 20))
            raise unknown_name("moving joint with the name or pattern", pattern, list(joints), example)
        reason = f"'{shortened(text)}' holds it"
        held.update((name, (resting(joints[name]) if value is None else value, reason)) for name in found)
    return held


def _parts(text: str) -> tuple[str, float | None]:
    pattern, _, value = text.rpartition("=")
    try:
        number = float(value)
    except ValueError:
        return text, None
    if not pattern:
        return text, None
    if not math.isfinite(number):
        raise InputError(f"'{shortened(text)}' holds a joint at {number}: give a finite number of rad or m.")
    return pattern, number


def _leaders(root: Element, link: str) -> set[str]:
    """Returns the names of the joints that those joints follow (mimic) that carry a link."""
    carriers, found = parent_joints(root), set[str]()
    while link in carriers:
        mimic = carriers[link].find("mimic")
        found |= set() if mimic is None else {mimic.get("joint", "")}
        link = end_of(carriers[link], "parent")
    return found


def hold_what_does_not_move(root: Element, tip: str) -> Iterator[Finding]:
    """Holds the joints that do not move the tip if more than `MAX_JOINTS` move. The other arm of a two-armed
    robot, which has as many joints as that of the tip, keeps moving. Yields one finding per body from which
    held joints branch off."""
    moving = {joint.get("name", ""): joint for joint in movable_joints(root)}
    if len(moving) <= MAX_JOINTS:
        return
    carried, links = chains(root), named(root, "link")
    chain = carried[tip]
    leaders = _leaders(root, tip)
    others = {carried[name] for name in not_legs(root) if len(carried[name]) == len(chain)} - {chain}
    both = {*chain, *(name for other in others for name in other)}
    kept = both if len(others) == 1 and len(both) <= MAX_JOINTS else {*chain, *leaders}
    groups: dict[str, list[str]] = {}
    for name, joint in moving.items():
        if name not in kept:
            first = next(each for each in carried[end_of(joint, "child")] if each not in kept)
            groups.setdefault(end_of(moving[first], "parent"), []).append(name)
    for body, names in groups.items():
        told = [freeze(moving[name], resting(moving[name]), "").text for name in names]
        where = "near 0" if all(resting(moving[name]) == 0.0 for name in names) else "as in the file's home"
        where = "at 0" if all(text.startswith("held at 0 ") for text in told) else where
        first, last = shortened(names[0]), shortened(names[-1])
        which = (
            f"1 joint that it carries ({first}) does"
            if first == last
            else (f"{len(names)} joints that it carries ({first} … {last}) do")
        )
        text = f"{which} not move the tip '{shortened(tip)}': held {where}; --hold or --tip chooses others"
        yield Finding("fixed", label(links[body]), text)
