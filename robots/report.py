"""The import report: the findings of the import of a robot description, as data that can be printed, sent to
a page or tested."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

Kind = Literal["repaired", "filled", "fixed", "refused", "note"]


@dataclass(frozen=True)
class Finding:
    """One finding of an import: something that it changed, noted or refused.

    kind: `repaired` (a value was wrong and was changed), `filled` (a value was missing), `fixed` (a joint was
    made fixed), `refused` (the description cannot be used), `note` (information; nothing was changed). where:
    the element, e.g. ``joint 'elbow'``. text: one sentence.
    """

    kind: Kind
    where: str
    text: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.where}: {self.text}"


@dataclass(frozen=True)
class ImportReport:
    """All findings of one import, in the order in which they were made.

    Attributes:
        tips: frames that are as likely as the tip.
        drawn: size of the largest link that meshes draw, divided by the length of the arm; None without
            meshes.
    """

    source: str
    findings: tuple[Finding, ...] = ()
    name: str = ""
    joints: tuple[str, ...] = ()
    tip: str = ""
    tips: tuple[str, ...] = ()
    drawn: float | None = None

    @property
    def usable(self) -> bool:
        """Whether a robot can be built from the description."""
        return not self.of_kind("refused")

    def of_kind(self, kind: Kind) -> tuple[Finding, ...]:
        """Returns the findings of one kind."""
        return tuple(finding for finding in self.findings if finding.kind == kind)

    def as_dict(self) -> dict[str, object]:
        """Returns the report as plain JSON types."""
        return {**asdict(self), "findings": [asdict(f) for f in self.findings], "usable": self.usable}
