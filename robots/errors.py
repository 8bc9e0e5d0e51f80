"""The one exception a user's mistake raises, and how a wrong name is answered."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class InputError(ValueError):
    """What the user gave cannot be used; the message is one sentence that says what to do next."""


def unknown_name(what: str, name: str, choices: Iterable[str], hint: str = "") -> InputError:
    """The error for a name that is not among `choices`: it names the nearest one and lists them all."""
    names = [str(choice) for choice in choices]
    folded = {choice.casefold(): choice for choice in reversed(names)}
    close = get_close_matches(str(name).casefold(), folded, n=1, cutoff=0.4)
    nearest = f"did you mean '{folded[close[0]]}'? " if close else ""
    listed = ", ".join(names[:40]) + (f", … ({len(names)} in all)" if len(names) > 40 else "")
    tail = f"; {hint}" if hint else ""
    return InputError(f"There is no {what} '{name}': {nearest}Choose one of {listed or '(none)'}{tail}.")
