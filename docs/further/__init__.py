"""What a lesson's page derives and asks beyond the lesson: one file per lesson, each defines `FURTHER`."""

from __future__ import annotations

from importlib import import_module

from docs.further.kit import Further


def further(lesson: str) -> Further:
    """Of a lesson by its name."""
    found: Further = import_module(f"docs.further.{lesson.replace('-', '_')}").FURTHER
    return found
