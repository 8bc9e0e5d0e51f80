"""Derivations and questions that a lesson's page adds to the lesson: one file per lesson, each defines
`FURTHER`."""

from __future__ import annotations

from importlib import import_module

from docs.further.kit import Further


def further(lesson: str) -> Further:
    """Returns the derivation and the questions of the lesson with this name."""
    found: Further = import_module(f"docs.further.{lesson.replace('-', '_')}").FURTHER
    return found
