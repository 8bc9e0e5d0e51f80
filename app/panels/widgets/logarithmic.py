"""Logarithmic sliders. viser's sliders have equal steps, so a logarithmic slider uses positions 0 … STEPS."""

from __future__ import annotations

import math
from typing import Any

import viser

from app.adapter.names import NUMBER_BOX, SLIDER_LABEL
from app.adapter.private import dom_id

STEPS = 200
"""Number of steps of a logarithmic slider."""


def place_of(value: float, low: float, high: float) -> int:
    """Returns the position 0 … STEPS of a value on a logarithmic slider."""
    share = math.log(max(value, 1e-300) / low) / math.log(high / low)
    return round(STEPS * min(max(share, 0.0), 1.0))


def value_at(place: float, low: float, high: float) -> float:
    """Returns the value at a position of a logarithmic slider, with three digits."""
    return float(f"{low * (high / low) ** (place / STEPS):.3g}")


def only_track(slider: viser.GuiSliderHandle[Any]) -> str:
    """Returns a style that hides the number box of a slider whose number is only a position."""
    here = f'[id="{dom_id(slider)}"]'
    return f"<style>{here} + {NUMBER_BOX},{here} {SLIDER_LABEL}{{display:none}}</style>"
