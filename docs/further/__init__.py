"""Derivations and questions on the page of each lesson. There is one file per lesson, and each file defines
`FURTHER`."""

from __future__ import annotations

from importlib import import_module

from docs.further.kit import Further


def further(lesson: str) -> Further:
    """Returns the derivation and the questions of the lesson with this name."""
    found: Further = import_module(f"docs.further.{lesson.replace('-', '_')}").FURTHER
    return found
