"""`load_robot`: a robot by its catalog name or from a URDF file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from robots.catalog import CATALOG, CatalogEntry
from robots.errors import InputError, unknown_name
from robots.home import choose_tip, find_home, sensible_a_max
from robots.inertia import suggest_M_bar
from robots.robot import Robot
from robots.urdf import UNBOUNDED, Canonical, canonicalise, load_bytes


def load_robot(name_or_path: str | Path, tip: str | None = None) -> Robot:
    """The robot with this catalog name, or the one described by a URDF file.

    tip: its default end-effector frame; None takes the catalog's, or the end of the longest chain.
    Raises InputError, one sentence that says what to do, for an unknown name, a missing file, a
    description that cannot be used, or an unknown tip.
    """
    text = str(name_or_path)
    if text in CATALOG:
        entry = CATALOG[text]
        canonical = canonicalise(load_bytes(entry.path), f"robots/{entry.name}", entry.path.parent)
        robot = _from_entry(canonical, entry)
    else:
        path = Path(text)
        if not path.exists() and "/" not in text and not path.suffix:
            raise unknown_name(
                "robot in the catalog called", text, CATALOG, "or give the path of a URDF file"
            )
        robot = _from_canonical(canonicalise(load_bytes(path), text, path.resolve().parent), None)
    return robot if tip is None else robot.with_tip(tip)


def load_urdf_text(text: str, tip: str | None = None) -> Robot:
    """The robot described by a URDF string (for an upload, or a canonical text sent to a child process).

    Raises InputError like `load_robot`.
    """
    return _from_canonical(canonicalise(text.encode(), "the URDF text"), tip)


def _from_canonical(canonical: Canonical, tip: str | None) -> Robot:
    model = canonical.model
    lower, upper = _bounds(model)
    frames = {f.name: i for i, f in enumerate(model.frames) if f.type == pin.FrameType.BODY}
    if tip is not None and tip not in frames:
        raise unknown_name(f"frame of robot '{canonical.name}' called", tip, frames)
    chosen = choose_tip(model, frames) if tip is None else tip
    try:
        M_bar = suggest_M_bar(model, lower, upper)
    except np.linalg.LinAlgError:
        M_bar = np.full(model.nv, np.nan)
    if not np.all(np.isfinite(M_bar) & (M_bar > 0.0)):
        raise InputError(
            f"{canonical.report.source} cannot be used: its mass matrix is singular; check its inertias."
        )
    return Robot(
        name=canonical.name,
        model=model,
        joint_names=tuple(model.names)[1:],
        tip=chosen,
        home=find_home(model, frames[chosen], lower, upper),
        q_lower=lower,
        q_upper=upper,
        v_limit=model.velocityLimit,
        tau_limit=model.effortLimit,
        a_max=sensible_a_max(model, lower, upper, model.effortLimit),
        M_bar=M_bar,
        urdf_text=canonical.text,
        report=replace(canonical.report, tip=chosen),
    )


def _from_entry(canonical: Canonical, entry: CatalogEntry) -> Robot:
    model = canonical.model
    lower, upper = _bounds(model)
    return Robot(
        name=entry.name,
        model=model,
        joint_names=tuple(model.names)[1:],
        tip=entry.tip,
        home=entry.home,
        q_lower=lower,
        q_upper=upper,
        v_limit=model.velocityLimit,
        tau_limit=model.effortLimit,
        a_max=np.array(entry.a_max),
        M_bar=np.array(entry.M_bar),
        urdf_text=canonical.text,
        report=replace(canonical.report, tip=entry.tip),
    )


def _bounds(model: pin.Model) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    return np.where(lower <= -UNBOUNDED, -np.inf, lower), np.where(upper >= UNBOUNDED, np.inf, upper)
