"""The entry point of the console script."""

from __future__ import annotations

import app.commands.early  # noqa: F401  (must be the first import)
from app.__main__ import main

__all__ = ["main"]
