"""Not in the paper: M̄ that looks after itself (`himpc.adaptation`), under payloads that nobody told of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from lessons.events import MoveTarget, Set
from lessons.experiments.jobs import Results, Run, Work
from lessons.papers.himpc_paper.iiwa import RT4_DATA_SHEET
from lessons.papers.item import Item, Row, Section
from lessons.papers.words import trouble
from lessons.scenes.run_spec import RunSpec
from lessons.session.start import begin
from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]

_ADAPTED = "M_bar_adapt=true"
_SETTINGS = {"as set": (), _ADAPTED: (_ADAPTED,)}
_HOLD = "iiwa14-hold"
_SECONDS = 4.0


class Case(NamedTuple):
    """A run with and without.

    Attributes:
        words: what is unusual about it.
        controller: which.
        scene: where.
        set: assignments.
        payload_later: kg at the flange from 2 s on; None: as before.
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
    *(Case(f"{_HOLD}, {kg:g} kg", scene=_HOLD, set=_payload(kg)) for kg in (0.0, 2.0, 4.0)),
    Case("hiqp, 4 kg", "hiqp", set=_payload(4.0)),
    Case("weighted, 2 kg", "weighted", set=_payload(2.0)),
)


@final
@dataclass(frozen=True)
class EigenvalueJob(Work):
    """A run during which the eigenvalues of M⁻¹M̄, M the plant's, are computed at every tick. A target that
    can be dragged jumps by up to 10 cm along each axis every half second.

    Its summary has `rms_mm`, the distance of the TCP from its reference after the first second; `largest`,
    the largest eigenvalue; `beyond_2`, for how many ticks on end one was above 2.
    """

    def do(self) -> Run:
        """The run; see `Work.do`."""
        session = begin(self.spec.prepared(), self.spec.seed)
        assert isinstance(session, TorqueSession)
        target, rng = session.target("position"), np.random.default_rng(0)
        start = None if target is None else np.array(target.raw)
        largest: list[float] = []
        errors: list[Array] = []
        for tick in range(round(_SECONDS / session.settings.T_s)):
            if start is not None and tick % 500 == 250:
                session.post(MoveTarget("position", tuple((start + rng.uniform(-0.1, 0.1, 3)).tolist())))
            # The M of the state in which the torque of this tick acts.
            M = session.plant.mass_matrix()
            row = session.tick()
            largest.append(_largest_eigenvalue(M, session.M_bar))
            errors.append(row[session.layout.fields["error/position"]].copy())
            if session.diverged_at is not None:
                break
        t = session.settings.T_s * np.arange(len(errors))
        distance = np.linalg.norm(errors, axis=1)[t >= 1.0]
        told: dict[str, Any] = {
            "diverged": session.diverged_at is not None,
            "diverged_at_s": session.diverged_at,
            "rms_mm": 1e3 * float(np.sqrt((distance**2).mean())) if len(distance) else math.nan,
            "largest": max(largest),
            "beyond_2": longest(np.array(largest) > 2.0),
        }
        return Run(self, told, {"t": t[:, None], "largest": np.array(largest)[:, None]})


def longest(flags: NDArray[np.bool_]) -> int:
    """How many in a row are true, at most."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _largest_eigenvalue(M: Array, M_bar: Array) -> float:
    root = np.sqrt(M_bar)
    return float(1.0 / np.linalg.eigvalsh(M / root[:, None] / root)[0])


def _job(case: Case, extra: tuple[str, ...]) -> EigenvalueJob:
    later = case.payload_later
    events = None if later is None else ((2.0, Set("plant.payload_kg", later)),)
    return EigenvalueJob(
        RunSpec(case.scene, controller=case.controller, set=(*case.set, *extra), events=events)
    )


def _jobs(quick: bool) -> tuple[EigenvalueJob, ...]:
    return () if quick else tuple(_job(case, extra) for case in CASES for extra in _SETTINGS.values())


FIGURES = {
    "RMS distance of the TCP after 1 s": ("rms_mm", "mm"),
    "largest eigenvalue of M⁻¹M̄": ("largest", "1"),
    "ticks on end beyond 2": ("beyond_2", "1"),
}


def quantity(case: Case, words: str, what: str) -> str:
    """The name of a row. Args: words: "as set" or the setting; what: of FIGURES."""
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
                rows.append(Row(quantity(case, words, what), unit, None, run.figure(key), why))
    return Section(rows=tuple(rows))


ITEMS = (
    Item("himpc-adaptation", "M̄ that looks after itself", "not in the paper; Remark 4", _jobs, _section),
)
