"""Writes the references of the tasks that the kernel computes to an arena."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from himpc.formulation.settings import Settings
from himpc.references import Outlook, Preview, Reference, Target
from himpc.tasks import Damping
from himpc.tick.configure import write_curve, write_preview
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import NOW
from himpc.tick.kernel.references import SAMPLED
from himpc.tick.python_rows import PythonRows


@final
class PreviewWriter:
    """Records the references that the arena of a tick already contains."""

    def __init__(self, arena: Arena, python_rows: PythonRows, settings: Settings) -> None:
        self._arena, self._python_rows, self._T_s = arena, python_rows, settings.T_s
        self._reach = settings.horizon + 1
        self._led = [entry for entry in python_rows.spans if not isinstance(entry[1], Damping)]
        self._read: dict[int, Reference | Preview | None] = {}

    def write(self, previews: Mapping[str, Preview]) -> None:
        """Writes the reference of every task that has changed: as coefficients if the kernel can evaluate it,
        otherwise as a preview."""
        f = self._arena.f
        references: Mapping[str, Reference] = {}
        t = 0.0
        if isinstance(previews, Outlook):
            references, t = previews.references, previews.t
            f["scalars"][NOW] = t
        for index, task, span in self._led:
            reference, read = references.get(task.name), self._read.get(index)
            target = reference if isinstance(reference, Target) else None
            if (reference is not None and reference is read) or (target and target.stays(t, read)):
                continue
            if target and self._shows(index, span, target, t):
                self._read[index] = None
            elif reference is not None and not target and write_curve(self._arena, index, span, reference):
                self._read[index] = reference
            else:
                preview = previews[task.name]
                if preview is not read:
                    write_preview(
                        self._arena, index, span, self._python_rows.at_first(task, preview), self._reach
                    )
                # A target at rest gives the same preview again; other previews may have changed.
                self._read[index] = preview if target else None

    def _shows(self, index: int, span: slice, target: Target, t: float) -> bool:
        """Lets a moving target write its motion to the arrays that the kernel reads; returns whether it
        did."""
        f = self._arena.f
        x_d = target.show(t, self._T_s, f["motion"][:, :, span])
        if x_d is None:
            return False
        self._arena.i["law"][index] = SAMPLED
        (f["x_d"][span] if target.raw.ndim == 1 else f["R_d"][index].reshape(9))[:] = x_d
        return True
