"""The picture of a drive: the curves of arm and model in the same axes, with errors and torques."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from himpc.export.image import Image
from lessons.plots.panels import Panel, Picture, PlotCurve

_POINTS = 4000
"""Largest number of points of a curve."""


def picture(name: str, data: Mapping[str, Any], image: Image) -> Picture:
    """Returns the plots of a drive over its time.

    Args:
        name: file name without extension.
        data: see `app.arm.recorded.arrays`.
        image: the exported controller of the drive.
    """
    some = slice(None, None, 1 + len(data["t"]) // _POINTS)
    t = data["t"][some] - data["t"][0] if len(data["t"]) else data["t"]
    q, model = (np.rad2deg(data[each][some] - data["q"][:1]) for each in ("q", "q_model"))
    tau, beside = data["tau"][some], data["tau_model"][some]
    names = [str(each) for each in data["joint_names"]]

    def both(first: Any, second: Any) -> tuple[PlotCurve, ...]:
        return tuple(
            PlotCurve(t, values[:, joint], label if style == "line" else "", str(joint), style)
            for values, style in ((first, "line"), (second, "dashed"))
            for joint, label in enumerate(names)
        )

    errors = []
    for place, task in enumerate(image.manifest["tasks"]):
        if task["target"] == "none" or not task["rows"]:
            continue
        unit, factor = ("mm", 1e3) if task["unit"] == "m" else ("°", 180 / np.pi)
        size = factor * np.linalg.norm(data[f"error/{task['name']}"][some], axis=1)
        errors.append(PlotCurve(t, size, f"{task['name']} ({unit})", str(place)))
    away = tuple(PlotCurve(t, (q - model)[:, joint], "", str(joint)) for joint in range(len(names)))
    missed = np.cumsum(data["missed"])[some]
    panels = (
        Panel("joints (°)", both(q, model)),
        Panel("arm − model (°)", away),
        Panel("error (mm or °)", tuple(errors)),
        Panel("torque (N·m)", both(tau, beside)),
        Panel("periods missed", (PlotCurve(t, missed, "", "7", "steps"),)),
    )
    return Picture(
        name,
        "A drive of an arm: joints since the start, torques without gravity. Dashed: the simulated robot.",
        panels,
    )
