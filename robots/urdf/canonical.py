"""Converts a URDF to its canonical form: the URDF is read, checked and repaired, and all changes are
reported. Every import of a URDF begins with this conversion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import shortened, unknown_name
from robots.joints import followed, joint_names
from robots.meshes.files import localise
from robots.report import Finding, ImportReport
from robots.urdf.hold import MAX_JOINTS, held_by_name, hold_what_does_not_move
from robots.urdf.inertials import ASSUMED, repair_inertials
from robots.urdf.joints import GRIPPER, HELD, coupling, normalise_joints, settle_followers
from robots.urdf.limits import fill_efforts, fill_speeds, fit_masses
from robots.urdf.read import Refusal, named, parse, without_shapes
from robots.urdf.shapes import remove_unusable_shapes
from robots.urdf.structure import check_structure, followers, movable_joints
from robots.urdf.tip import TOOL, add_tool, choose_tip

MAX_FINDINGS = 200
_ALIKE = 4  # largest number of other frames that the note about the tip lists


@dataclass(frozen=True)
class Canonical:
    """A URDF that Pinocchio, MuJoCo and the page interpret in the same way."""

    name: str
    text: str
    model: pin.Model
    report: ImportReport


def canonicalise(
    data: bytes,
    source: str,
    folder: Path | None = None,
    within: Path | None = None,
    tip: str | None = None,
    hold: tuple[str, ...] = (),
) -> tuple[Canonical | None, ImportReport]:
    """Returns the canonical form of a URDF document (None if it cannot be used) and the report of the import.

    source: name of the document in messages. folder: folder from which relative and `package://` mesh paths
    are searched; None for a description that may use installed packages only. within: folder that must
    contain all meshes except installed ones; None: meshes may be anywhere. tip: see `choose_tip` for None.
    hold: see `held_by_name`.

    Raises InputError if the tip is no link, or for a pattern in `hold` that fits no joint.
    """
    try:
        root, findings = parse(data, source)
    except Refusal as refusal:
        return None, _report(source, [refusal.finding])

    def refused_by(*passes: Callable[[Element], Iterable[Finding]]) -> bool:
        for each in passes:
            findings.extend(each(root))
            if any(finding.kind == "refused" for finding in findings):
                return True
        return False

    if refused_by(
        lambda tree: check_structure(tree, source),
        lambda tree: normalise_joints(tree, held_by_name(tree, hold)),
    ):
        return None, _report(source, findings)
    chosen, alike, told = _tip(root, tip)
    if refused_by(
        lambda _: told,
        lambda tree: hold_what_does_not_move(tree, chosen),
        settle_followers,
        lambda tree: _check_freedom(tree, source),
        repair_inertials,
        fill_speeds,
        remove_unusable_shapes,
    ):
        return None, _report(source, findings)
    findings.extend(localise(root, folder, within))
    try:
        findings.extend(fit_masses(root, pinocchio_model(root)))
        for inertial in root.iterfind("link/inertial"):
            inertial.attrib.pop(ASSUMED, None)
        for joint in root.iterfind("joint"):
            for attribute in (HELD, GRIPPER):
                joint.attrib.pop(attribute, None)
        model = pinocchio_model(root)
        findings.extend(fill_efforts(root, model))
    except Refusal as refusal:
        return None, _report(source, [*findings, refusal.finding])
    name = shortened(root.get("name", "").strip())
    report = replace(_report(source, findings), name=name, joints=joint_names(model), tip=chosen, tips=alike)
    text = etree.tostring(root, encoding="unicode", pretty_print=True)
    return Canonical(name, text, model, report), report


def _report(source: str, findings: list[Finding]) -> ImportReport:
    """Returns the report. If there are too many findings, refused findings come first and the last ones are
    left out."""
    if len(findings) > MAX_FINDINGS:
        kept = sorted(findings, key=lambda finding: finding.kind != "refused")[:MAX_FINDINGS]
        more = f"{len(findings) - MAX_FINDINGS} more findings are not listed"
        findings = [*kept, Finding("note", source, more)]
    return ImportReport(source, tuple(findings))


def _tip(root: Element, asked: str | None) -> tuple[str, tuple[str, ...], tuple[Finding, ...]]:
    """Returns the tip, the frames that are as likely, and a note of them if nobody has named the tip. A tip
    with a tool, "FRAME@x,y,z,roll,pitch,yaw", is a new frame."""
    links = named(root, "link")
    if asked is not None and asked not in links and TOOL in asked:
        frame, place = asked.rsplit(TOOL, 1)
        carrier, *_ = _tip(root, frame or None)
        text = f"a tool at {shortened(place)} (m, rad) on '{shortened(carrier)}'"
        return add_tool(root, carrier, place), (), (Finding("note", "tip", text),)
    if asked is not None and asked not in links:
        name = shortened(root.get("name", "").strip())
        raise unknown_name(f"frame of robot '{name}' called", asked, links)
    chosen, alike = choose_tip(root)
    if asked is not None:
        likely = (chosen, *alike)
        return asked, tuple(name for name in likely if name != asked) if asked in likely else (), ()
    if not alike:
        return chosen, (), ()
    names = ", ".join(shortened(name) for name in alike[:_ALIKE]) + ", …" * (len(alike) > _ALIKE)
    note = Finding("note", "tip", f"'{shortened(chosen)}' was chosen; as likely: {names} (--tip)")
    return chosen, alike, (note,)


def _check_freedom(root: Element, source: str) -> Iterator[Finding]:
    count = len(movable_joints(root))
    if count == 0:
        text = "none of its joints moves: all are fixed, or held (a floating base, a gripper, no range)"
        yield Finding("refused", source, f"{text}; give a robot with a movable joint")
    elif count > MAX_JOINTS:
        text = f"it has {count} moving joints; at most {MAX_JOINTS} can be controlled every millisecond"
        yield Finding("refused", source, f"{text}: hold the others with --hold PATTERN")


def canonical_model(text: str) -> pin.Model:
    """Returns the Pinocchio model of a canonical description."""
    return pinocchio_model(etree.fromstring(text))


def pinocchio_model(root: Element) -> pin.Model:
    """Returns the Pinocchio model of a repaired tree. Raises Refusal for a tree that Pinocchio cannot
    build."""
    try:
        model = pin.buildModelFromXML(without_shapes(root))
    except (ValueError, RuntimeError) as error:
        reason = shortened(next(iter(str(error).strip().splitlines()), type(error).__name__), 100)
        raise Refusal("robot", f"Pinocchio cannot build it ({reason})") from None
    if model.nq != model.nv or model.nv != model.njoints - 1:
        raise Refusal("robot", "a joint has more than one coordinate; only one-axis joints are supported")
    for joint in range(1, model.njoints):
        moments = np.linalg.eigvalsh(model.inertias[joint].inertia)
        # MuJoCo requires moments of at least 1e-15. It also rejects inertias with A + B < C, even if the
        # difference is a rounding error.
        if not (moments[0] > max(1e-14, 1e-12 * moments[2]) and moments[0] + moments[1] > moments[2]):
            text = "no simulator can use the inertia of the body that it moves; check its masses and origins"
            raise Refusal(f"joint '{model.names[joint]}'", text)
    for joint in followers(root):
        model = followed(model, joint.get("name", ""), *coupling(joint))
    return model
