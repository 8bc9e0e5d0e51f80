"""Numba's options for arithmetic, which both tool chains use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Function = Callable[..., Any]

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz"}}
"""Sums may be computed in any order. NaN and infinity are supported. A division by zero raises no
exception."""
