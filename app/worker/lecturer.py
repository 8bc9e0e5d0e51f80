"""Follows the run of an exercise in the simulation process: records the run, evaluates the claims, and
reports the end.

A run lasts from t = 0 to the exercise's duration. Afterwards the robot can be moved freely, and the measured
values stay.
"""

from __future__ import annotations

import contextlib
import math
from time import perf_counter
from typing import Any

import numpy as np

from app.link.exercise import Answer, Lecture, LessonPlace, Phase, SignalCurve, signals_of
from himpc.telemetry import Layout
from lessons.events import Event
from lessons.scenes.scene import Scene
from lessons.session.session import Session
from lessons.session.start import begin
from lessons.settings.settings import SceneSettings, settings_after
from lessons.teaching.lesson import Challenge, Step, within
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, PredictionResult, Sketch, Value
from robots import InputError

BUCKETS = 120
_JUDGE_EVERY = 5  # number of reports between two judgements, which are made twice a second
_CHUNK = 0.01  # s: the longest computation of the ghost between two checks for commands
FAST = 50.0
"""Simulation speed for a run that should end as soon as possible. No computer can reach this speed."""

Array = np.ndarray


class GhostRun:
    """A run that is computed in small pieces, until `finished` is true."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self._session = begin(scene, seed)
        self._ticks = max(1, round(scene.duration / self._session.settings.T_s))
        self.record = LessonRows(self._session.layout, self._ticks)

    @property
    def finished(self) -> bool:
        session = self._session
        return len(self.record) >= self._ticks or session.diverged_at is not None or session.over

    def work(self, seconds: float) -> None:
        """Continues the run for about this wall time."""
        until = perf_counter() + seconds
        while not self.finished and perf_counter() < until:
            self.record.add(self._session.tick())


def ghost_of(exercise: LessonPlace, seed: int) -> GhostRun | None:
    """Returns the second robot's run if a claim or a prediction is compared with it; else None."""
    step = exercise.part
    if not isinstance(step, Step) or step.ghost is None:
        return None
    return GhostRun(exercise.run.but(*step.ghost.set).prepared(), seed)


class LessonRows:
    """Telemetry rows since the run's start; `record[field]` is (ticks, width), like a finished recording."""

    def __init__(self, layout: Layout, room: int, rows: np.ndarray | None = None) -> None:
        """room: expected number of rows; rows: the rows so far."""
        self._layout = layout
        self._rows = np.empty((max(room, 1), layout.size)) if rows is None else rows
        self._count = 0 if rows is None else len(rows)

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, field: str) -> np.ndarray:
        return self._rows[: self._count, self._layout.fields[field]]

    def add(self, row: np.ndarray) -> None:
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[self._count] = row
        self._count += 1

    def until(self, t: float) -> LessonRows:
        count = int(np.searchsorted(self["t"][:, 0], t + 1e-9, "right"))
        return LessonRows(self._layout, count, self._rows[:count])


def thinned(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Decimates a curve to its two ends and at most 2 · BUCKETS points: the minimum and the maximum of the
    finite values in each bucket, each at its own time."""
    if len(t) <= 2 * BUCKETS:
        return t.copy(), values.copy()
    starts = np.arange(BUCKETS + 1) * (len(t) - 1) // BUCKETS + 1
    starts[0] = 0
    places = np.minimum(starts[:-1, None] + np.arange(np.diff(starts).max()), starts[1:, None] - 1)
    found = values[places]
    known = np.isfinite(found)
    low = np.where(known, found, np.inf).argmin(axis=1)
    high = np.where(known, found, -np.inf).argmax(axis=1)
    kept = np.unique(np.concatenate([[0], starts[:-1] + low, starts[:-1] + high, [len(t) - 1]]))
    return t[kept], values[kept]


class Lecturer:
    """The lecturer of one exercise. session: at t = 0, before the first tick."""

    def __init__(self, exercise: LessonPlace, session: Session, seed: int = 0) -> None:
        self.exercise = exercise
        self.answer: Answer | None = None
        self.fast = False
        self._part = exercise.part
        self._ghost = ghost_of(exercise, seed)
        self._attempt = 0
        self._reports = 0
        self._grade: PredictionResult | None = None
        self._truth = math.nan
        self._sketched: SignalCurve | None = None
        self._posted: list[Event] = []
        self._own = session.settings
        self._phase: Phase = "waiting"
        self._enter(session)

    def _enter(self, session: Session) -> None:
        self._session = session
        self._record = self._empty_record()
        self._before = -math.inf
        self._touched = self._differs = False
        self._foreign = ""
        self._lost_at: float | None = None
        self._last: Lecture | None = None

    def _empty_record(self) -> LessonRows:
        ticks = math.ceil(self._part.duration / self._session.settings.T_s)
        return LessonRows(self._session.layout, ticks + 1)

    # ---------------------------------------------------------------- the run

    @property
    def waiting(self) -> bool:
        return self._phase in ("waiting", "preparing")

    @property
    def busy(self) -> bool:
        """Whether the ghost is being computed although no run is active."""
        return self.waiting and self._ghost is not None and not self._ghost.finished

    @property
    def pace(self) -> float | None:
        """The speed of the simulation as a multiple of real time; None: the speed that the learner set."""
        return FAST if self.fast and self._phase == "running" else None

    @property
    def unanswered(self) -> bool:
        """Whether the learner must make a prediction first."""
        return (
            self.waiting
            and isinstance(self._part, Step)
            and self._part.prediction is not None
            and self.answer is None
        )

    def settings(self, own: bool) -> SceneSettings:
        """Returns the settings at the start of a run: the lesson's settings, or the learner's. In both cases,
        the changes by the script of the last run are undone."""
        if own and isinstance(self._part, Step):
            self._posted.clear()
        return settings_after(self._own, self._posted)

    def begin(self, session: Session, fast: bool) -> bool:
        """Begins a run of a new session; returns False if the ghost must be computed first."""
        self._enter(session)
        self.fast = fast
        self._attempt += 1
        self._differs = session.settings != self._own
        self._foreign = self._foreign_change() if isinstance(self._part, Challenge) else ""
        self._phase = "waiting"
        self._phase = "preparing" if self.busy else "running"
        return self._phase == "running"

    def idle(self) -> bool:
        """Computes a part of the ghost; returns whether a run that waited for the ghost begins now."""
        if self.waiting and self._ghost is not None:
            self._ghost.work(_CHUNK)
        if self._phase != "preparing" or self.busy:
            return False
        self._phase, self._last = "running", None
        return True

    def touch(self, event: Event) -> None:
        """Notes that the learner changed a setting, pushed the robot or dragged a target."""
        self._touched = self._touched or self._phase == "running"
        with contextlib.suppress(InputError):  # an event that the session refuses changes nothing
            settings_after(self._session.settings, [event])
            self._posted.append(event)

    def follow(self, row: Array) -> bool:
        """Adds a row of telemetry; returns whether the run ended with this row."""
        session = self._session
        if self._phase != "running":
            return False
        t = float(row[session.layout.fields["t"].start])
        if t <= self._before:
            self._record = self._empty_record()  # the run was reset to its start
        self._before = t
        self._record.add(row)
        self._lost_at = session.diverged_at
        ended = self._lost_at is not None or session.over
        if not ended and session.t < self._part.duration - 0.5 * session.settings.T_s:
            return False
        self._phase, self._last, self.fast = "done", None, False
        if not self._words_of_change():
            self._weigh_prediction()
        return True

    def _foreign_change(self) -> str:
        """Returns a sentence if an attempt at a challenge cannot count: a setting that does not belong to
        the challenge was changed, or one that belongs to it is outside its range. Otherwise returns ""."""
        assert isinstance(self._part, Challenge)
        now = self._session.settings
        allowed = self._own
        for knob in self._part.knobs:
            value: Any = now.value_at(knob.path)
            if value != self._own.value_at(knob.path):
                if not within(now, knob):
                    return f"{knob.words} is outside the range that this challenge allows."
                allowed = allowed.changed(knob.path, value)
        return "" if allowed == now else "A setting was changed that does not belong to this challenge."

    # ---------------------------------------------------------------- reports

    def report(self) -> Lecture | None:
        """Returns the present state of the exercise; None if nothing has changed since the last report."""
        self._reports += 1
        due = self._phase == "running" and self._reports % _JUDGE_EVERY == 0
        if self._last is not None and self._last.answer == self.answer and not due:
            return None
        self._last = self._judged()
        return self._last

    def _judged(self) -> Lecture:
        part, record, ghost = self._part, self._record, self._ghost_so_far()
        claims = part.claims if isinstance(part, Step) else part.goals
        values = tuple(_value(claim.measure, record, ghost) for claim in claims)
        over = self._phase == "done"
        signals = signals_of(part)
        return Lecture(
            exercise=self.exercise,
            phase=self._phase,
            attempt=self._attempt,
            t=min(float(record["t"][-1, 0]) + self._session.settings.T_s, part.duration)
            if len(record)
            else 0.0,
            duration=part.duration,
            answer=self.answer,
            changed=self._words_of_change(),
            values=values,
            holds=tuple(
                None if math.isnan(value) else claim.holds(value)
                for claim, value in zip(claims, values, strict=True)
            ),
            truth=self._truth,
            grade=self._grade,
            curves=_curves(signals, record),
            ghosts=() if ghost is None else _curves(signals, ghost),
            sketched=self._sketched,
            result=part.grade(record) if over and isinstance(part, Challenge) else None,
            points_for=part.score.measure.value(record) if isinstance(part, Challenge) else math.nan,
            lost_at=self._lost_at,
        )

    def _ghost_so_far(self) -> LessonRows | None:
        if self._ghost is None or not len(self._record) or not len(self._ghost.record):
            return None
        if self._phase == "done":  # in a mission, one of the two runs may last longer than the other
            return self._ghost.record
        return self._ghost.record.until(float(self._record["t"][-1, 0]))

    def _words_of_change(self) -> str:
        if isinstance(self._part, Challenge):
            moved = "You changed or moved something during the run; only the part before that counts."
            return self._foreign or (moved if self._touched else "")
        if self._differs:
            return "Your run: its settings differ from the lesson's."
        return "Your run: you changed or moved something during it." if self._touched else ""

    def _weigh_prediction(self) -> None:
        """Grades the prediction with the values of the lesson's own run."""
        prediction = self._part.prediction if isinstance(self._part, Step) else None
        if prediction is None or self.answer is None:
            return
        ghost, answer = self._ghost_so_far(), self.answer
        self._truth = prediction.measure.value(self._record, ghost)
        match prediction:
            case Sketch():
                assert isinstance(answer, tuple)
                self._grade = prediction.grade(answer, self._record)
                self._sketched = _curve(prediction.signal, self._record)
            case Choice():
                assert isinstance(answer, int)
                self._grade = prediction.grade(answer, self._record, ghost)
            case Value():
                assert isinstance(answer, (int, float))
                self._grade = prediction.grade(answer, self._record, ghost)


def _value(measure: Measure, record: LessonRows, ghost: LessonRows | None) -> float:
    return measure.value(record, ghost) if len(record) else math.nan


def _curve(signal: Signal, record: LessonRows) -> SignalCurve:
    return SignalCurve(*thinned(record["t"][:, 0], signal.over(record)))


def _curves(signals: tuple[Signal, ...], record: LessonRows) -> tuple[SignalCurve, ...]:
    return tuple(_curve(signal, record) for signal in signals) if len(record) else ()
