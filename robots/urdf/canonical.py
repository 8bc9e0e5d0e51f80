"""The one way a URDF enters the project: read, check, repair, report."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import InputError
from robots.meshes import absolutise
from robots.report import Finding, ImportReport
from robots.urdf.inertials import repair_inertials
from robots.urdf.joints import normalise_joints
from robots.urdf.limits import fill_efforts, fill_speeds
from robots.urdf.read import Refusal, parse, read_file
from robots.urdf.structure import check_structure, movable_joints

MAX_JOINTS = 100


@dataclass(frozen=True)
class Canonical:
    """A URDF that Pinocchio, MuJoCo, placo and the page all read the same way."""

    name: str
    text: str
    model: pin.Model
    report: ImportReport


def canonicalise(data: bytes, source: str, folder: Path | None = None) -> Canonical:
    """The canonical form of a URDF document.

    source: how messages name it; folder: where relative and `package://` mesh paths start from.
    Raises InputError with the first reason when the document cannot be used.
    """
    canonical, findings = _import(data, source, folder)
    if canonical is None:
        refused = [finding for finding in findings if finding.kind == "refused"]
        more = f" (and {len(refused) - 1} more; see `himpc-lab robots --check`)" if len(refused) > 1 else ""
        where = "" if refused[0].where == source else f"{refused[0].where}: "
        raise InputError(f"{source} cannot be used: {where}{refused[0].text}{more}.")
    return canonical


def check_bytes(data: bytes, source: str, folder: Path | None = None) -> ImportReport:
    """The import report of a URDF document; never raises for what the document contains."""
    canonical, findings = _import(data, source, folder)
    return ImportReport(source, findings) if canonical is None else canonical.report


def check_urdf(path: str | Path) -> ImportReport:
    """The import report of a URDF file: what would be repaired, filled, fixed or refused.

    Never raises for bad content; raises InputError when there is no such file.
    """
    file = Path(path)
    return check_bytes(load_bytes(file), str(path), file.resolve().parent)


def load_bytes(path: Path) -> bytes:
    """The content of a URDF file. Raises InputError when it cannot be read."""
    try:
        return read_file(path)
    except OSError as error:
        reason = "it is a folder" if path.is_dir() else error.strerror or str(error)
        raise InputError(f"Cannot read the URDF '{path}': {reason}; give the path of a URDF file.") from None


def _import(data: bytes, source: str, folder: Path | None) -> tuple[Canonical | None, tuple[Finding, ...]]:
    try:
        root = parse(data, source)
    except Refusal as refusal:
        return None, (refusal.finding,)
    findings: list[Finding] = []
    passes: tuple[Callable[[Element], Iterator[Finding]], ...] = (
        lambda tree: check_structure(tree, source),
        normalise_joints,
        repair_inertials,
        fill_speeds,
        lambda tree: _check_freedom(tree, source),
    )
    for each in passes:
        findings.extend(each(root))
        if any(finding.kind == "refused" for finding in findings):
            return None, tuple(findings)
    findings.extend(absolutise(root, folder))
    try:
        findings.extend(fill_efforts(root, _model(root)))
        model = _model(root)
    except Refusal as refusal:
        return None, (*findings, refusal.finding)
    name = root.get("name", "").strip() or "robot"
    report = ImportReport(source, tuple(findings), name, tuple(model.names)[1:])
    text = etree.tostring(root, encoding="unicode", pretty_print=True)
    return Canonical(name, text, model, report), tuple(findings)


def _check_freedom(root: Element, source: str) -> Iterator[Finding]:
    count = len(movable_joints(root))
    if count == 0:
        yield Finding("refused", source, "no joint of it moves; give a robot with at least one movable joint")
    elif count > MAX_JOINTS:
        yield Finding("refused", source, f"it has {count} joints; at most {MAX_JOINTS} are supported")


def _model(root: Element) -> pin.Model:
    """The Pinocchio model of a repaired tree. Raises Refusal for what Pinocchio cannot take."""
    try:
        model = pin.buildModelFromXML(etree.tostring(root, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise Refusal("robot", f"Pinocchio cannot build it ({str(error).strip().splitlines()[0]})") from None
    if model.nq != model.nv or model.nv != model.njoints - 1:
        raise Refusal("robot", "a joint has more than one coordinate; only one-axis joints are supported")
    for joint in range(1, model.njoints):
        moments = np.linalg.eigvalsh(model.inertias[joint].inertia)
        # MuJoCo's own smallest moment is 1e-15, and A + B < C by rounding is fatal to it as well.
        if not (moments[0] > max(1e-14, 1e-12 * moments[2]) and moments[0] + moments[1] > moments[2]):
            text = "the body it moves has an inertia no simulator can use; check masses and origins there"
            raise Refusal(f"joint '{model.names[joint]}'", text)
    return model
