"""A note beside a sentence of a lesson: the run that allows the sentence."""

from __future__ import annotations

from dataclasses import dataclass, replace

from lessons.scenes.run_spec import RunSpec
from lessons.teaching.measure import Measure

Range = tuple[float, float]


@dataclass(frozen=True)
class Note:
    """What allows a sentence: a range in which a number lies, in a run with the cause that the sentence names
    and in a run without it; or the statement that the number or reason is given, or tested elsewhere.

    Attributes:
        label: the name of the note in its file.
        says: the words before the first mark of the note, from the beginning of their sentence.
        measure: the number that the sentence names; None: it is not measured here.
        inside: least and greatest value of the number, in the unit of the measure.
        set: assignments of the run in addition to those of the step.
        ghost: whether the run is that of the step's ghost.
        on: the scene, if the run is not that of the step; then the step's settings and events do not count.
        seconds: the duration, if it is not that of the run.
        without: assignments that remove the cause which the sentence names.
        outside: as `inside`, without the cause. The two ranges are disjoint if the cause has this effect, and
            overlap if the sentence says that it has not.
        statement: what is said instead of a measure: "given: …" or "tested by FILE::NAME".
    """

    label: str
    says: str = ""
    measure: Measure | None = None
    inside: Range = (0.0, 0.0)
    set: tuple[str, ...] = ()
    ghost: bool = False
    on: str = ""
    seconds: float | None = None
    without: tuple[str, ...] = ()
    outside: Range = (0.0, 0.0)
    statement: str = ""

    def runs(self, own: RunSpec | None = None, ghost: tuple[str, ...] = ()) -> tuple[RunSpec, ...]:
        """Returns the run with the cause and, if the note removes the cause, the run without it. A measure
        that compares with the ghost needs the ghost's run, too, which comes last.

        Args:
            own: the run of the step; None: the note names a scene.
            ghost: the settings of the step's ghost.
        """
        base = RunSpec(self.on) if self.on or own is None else own
        if self.seconds is not None:
            base = replace(base, duration=self.seconds)
        if self.ghost:
            base = base.but(*ghost)
        runs = [base.but(*self.set)]
        if self.without:
            runs.append(base.but(*self.set, *self.without))
        if self.measure is not None and self.measure.over_ghost and own is not None:
            runs.append(own.but(*ghost))
        return tuple(runs)
