"""How both tool chains have Numba translate arithmetic."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Function = Callable[..., Any]

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz"}}
"""Sums may be taken in any order; NaN and infinity keep their meaning; a division by zero raises nothing."""
