"""The description of a setting for users: one row with its label, unit, help text and usual range."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property


@dataclass(frozen=True)
class Entry:
    """A row of a table of settings. The allowed values of a setting are declared at its field, see
    `robots.ranges`; this row gives the usual values.

    Attributes:
        path: as in `--set`; "*" stands for a name: "levels.*.Q".
        label: a few words or a symbol.
        help: one or two sentences; empty if the label is enough.
        unit: of the value.
        low, high, step: range and step of a slider, in the unit `shown`; a value outside extends the range.
            step 0: about a hundredth of the range.
        log: whether the slider is logarithmic; then low > 0.
        shown: the unit that the page shows instead; empty: `unit`.
        factor: how many units `shown` are equal to one `unit`.
        tries: typical values for comparisons, as the user types them; the first is rarely a scene's own
            value.
        name: used instead of the label if no heading names the group.
    """

    path: str
    label: str
    help: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    log: bool = False
    shown: str = ""
    factor: float = 1.0
    tries: tuple[str, ...] = ()
    name: str = ""

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """A pattern that matches all paths of the entry; its groups are the names."""
        return re.compile("(.+)".join(map(re.escape, self.path.split("*"))))

    @property
    def title(self) -> str:
        """The label with the unit that the page shows."""
        unit = self.shown or self.unit
        return f"{self.label} [{unit}]" if unit else self.label

    def at(self, path: str) -> Entry | None:
        """Returns the entry of one setting, with names instead of "*"; None if the path belongs to another
        entry."""
        found = self.pattern.fullmatch(path)
        if found is None:
            return None
        label, name = self.label, self.name or self.label
        for part in found.groups():
            label, name = label.replace("*", part, 1), name.replace("*", part, 1)
        return replace(self, path=path, label=label, name=name)


def entry_at(entries: tuple[Entry, ...], path: str) -> Entry:
    """Returns the entry of a path; if the table has none, an entry whose label is the last name of the
    path."""
    for entry in entries:
        found = entry.at(path)
        if found is not None:
            return found
    last = path.rpartition(".")[2]
    return Entry(path, last, name=path)
