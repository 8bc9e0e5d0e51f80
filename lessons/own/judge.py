"""Loads a file first in a separate process with a deadline, where it can do no harm."""

from __future__ import annotations

import math
from functools import lru_cache

from lessons.own.files import Source
from lessons.own.kinds import Kind, kind_of
from lessons.own.load import load
from robots import InputError
from robots.processes.isolation import Allowance, Fault, isolated

LOADING = Allowance(10.0, 2_000_000_000, "loading it", "ends the program", "leave that out")
"""Limits for loading a file before it is known to be harmless."""


@lru_cache(maxsize=64)
def judged(source: Source) -> Kind:
    """Returns the kind of a file. Raises InputError, with one sentence, if it cannot be loaded within the
    limits."""
    try:
        return isolated(_kind, source, within=LOADING, copied=True)
    except Fault as fault:
        raise InputError(f"{source.path}: {fault}") from None


def _kind(source: Source) -> Kind:
    return kind_of(load(source, math.inf))
