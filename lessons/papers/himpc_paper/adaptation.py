"""Not in the paper: M̄ that adapts to the payload (`himpc.controllers.adaptation`), under payloads that the
controller does not know.
"""

from __future__ import annotations

from typing import NamedTuple

from lessons.experiments.eigenvalues import EigenvalueJob
from lessons.experiments.jobs import Results
from lessons.papers.himpc_paper.iiwa import RT4_DATA_SHEET
from lessons.papers.item import Section
from lessons.papers.texts import described
from lessons.papers.words import trouble, unprinted
from lessons.scenes.run_spec import RunSpec

_ADAPTED = "M_bar_adapt=true"
_SETTINGS = {"as set": (), _ADAPTED: (_ADAPTED,)}
_HOLD = "iiwa14-hold"


class Case(NamedTuple):
    """A run with and without adaptation.

    Attributes:
        words: the name of the case.
        controller: name of the controller.
        scene: name of the scene.
        set: assignments.
        payload_later: payload at the flange from 2 s on, kg; None: the payload does not change.
    """

    words: str
    controller: str = "himpc"
    scene: str = RT4_DATA_SHEET
    set: tuple[str, ...] = ()
    payload_later: float | None = None


def _payload(kg: float) -> tuple[str, ...]:
    return (f"plant.payload_kg={kg:g}",) if kg else ()


CASES = (
    *(Case(f"{kg:g} kg", set=_payload(kg)) for kg in (0.0, 0.5, 2.0, 4.0, 6.0)),
    Case("2 kg, 4 kg from 2 s on", set=_payload(2.0), payload_later=4.0),
    *(
        Case(f"2 kg, encoders of {deg}°", set=(*_payload(2.0), f"plant.encoder_resolution_deg={deg}"))
        for deg in ("0.00001", "0.0001", "0.001")
    ),
    *(
        Case(
            f"{_HOLD}, {kg:g} kg",
            scene=_HOLD,
            set=("avoidance.on=false", "limits.stall_guard=false", *_payload(kg)),
        )
        for kg in (0.0, 2.0, 4.0)
    ),
    Case("hiqp, 4 kg", "hiqp", set=_payload(4.0)),
    Case("weighted, 2 kg", "weighted", set=_payload(2.0)),
)


def _job(case: Case, extra: tuple[str, ...]) -> EigenvalueJob:
    spec = RunSpec(case.scene, controller=case.controller, set=(*case.set, *extra))
    return EigenvalueJob(spec, payload_later=case.payload_later)


def _jobs(quick: bool) -> tuple[EigenvalueJob, ...]:
    return () if quick else tuple(_job(case, extra) for case in CASES for extra in _SETTINGS.values())


FIGURES = {
    "RMS distance of the TCP after 1 s": ("rms_mm", "mm"),
    "largest eigenvalue of M⁻¹M̄": ("largest", "1"),
    "most consecutive ticks with an eigenvalue above 2": ("beyond_2", "1"),
}


def quantity(case: Case, words: str, what: str) -> str:
    """Returns the name of a row. Args: words: "as set" or the setting; what: a name of FIGURES."""
    return f"{case.words}, {words}: {what}"


def _section(results: Results, quick: bool) -> Section:
    if quick:
        return Section(notes=("Only in the whole version.",))
    rows = []
    for case in CASES:
        for words, extra in _SETTINGS.items():
            run = results[_job(case, extra)]
            why = trouble(run) or "not in the paper"
            for what, (key, unit) in FIGURES.items():
                rows.append(unprinted(quantity(case, words, what), unit, run.figure(key), why))
    return Section(rows=tuple(rows))


ITEMS = (described("himpc-adaptation", _jobs, _section),)
