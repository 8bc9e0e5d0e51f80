"""`InputError`, the exception for every invalid input, and the error message for an unknown name."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

_LISTED = 600  # largest number of characters of the list of choices; the whole catalog fits
_COMPARED = 100  # number of compared characters of a name; the computing time grows with its square


class InputError(ValueError):
    """Raised if an input cannot be used. The message is one sentence that tells the user what to do next."""


def shortened(text: str, most: int = 60) -> str:
    """Returns a name or path in printable form for a message. If it is too long, its middle is left out."""
    if len(text) > most:
        head = (most - 3) // 3
        text = text[:head] + "..." + text[len(text) - (most - 3 - head) :]
    return "".join(each if each.isprintable() else "?" for each in text)


def listed(names: Iterable[str], most: int = 3, width: int = 60) -> str:
    """Returns the first names for a message, each in quotation marks and at most `width` characters long."""
    every = list(names)
    quoted = ", ".join(f"'{shortened(name, width)}'" for name in every[:most])
    return quoted + (", …" if len(every) > most else "")


def nearest_name(name: str, choices: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Returns the choice that is most similar to a name, or None if no choice is similar."""
    folded = {choice.casefold(): choice for choice in reversed(list(choices))}
    close = get_close_matches(name[:_COMPARED].casefold(), folded, n=1, cutoff=cutoff)
    return folded[close[0]] if close else None


def unknown_name(what: str, name: str, choices: Iterable[str], hint: str = "") -> InputError:
    """Returns the error for a name that is not among `choices`. The message contains the most similar choice
    and the list of all choices, or the first eight if one is similar."""
    names = [str(choice) for choice in choices]
    close = nearest_name(str(name), names, cutoff=0.4)
    nearest = f"did you mean '{shortened(close)}'? " if close else ""
    listed: list[str] = []
    for each in names[: 8 if close else 40]:
        if sum(map(len, listed)) + len(each) > _LISTED:
            break
        listed.append(shortened(each))
    more = f", … ({len(names)} in all)" if len(names) > len(listed) else ""
    tail = f"; {hint}" if hint else ""
    choose = f"Choose one of {', '.join(listed) or '(none)'}{more}{tail}"
    return InputError(f"There is no {what} '{shortened(str(name), 100)}': {nearest}{choose}.")
