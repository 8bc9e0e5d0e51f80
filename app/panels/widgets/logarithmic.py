"""Sliders in equal ratios: viser's go in equal steps, so theirs are places between the ends."""

from __future__ import annotations

import math
from typing import Any

import viser

from app.adapter.private import dom_id

STEPS = 200
"""Places of a logarithmic slider."""


def place_of(value: float, low: float, high: float) -> int:
    """Where a value stands on a logarithmic slider, 0 … STEPS."""
    share = math.log(max(value, 1e-300) / low) / math.log(high / low)
    return round(STEPS * min(max(share, 0.0), 1.0))


def value_at(place: float, low: float, high: float) -> float:
    """The value at a place of a logarithmic slider, with three digits."""
    return float(f"{low * (high / low) ** (place / STEPS):.3g}")


def only_track(slider: viser.GuiSliderHandle[Any]) -> str:
    """A style that hides the numbers of a slider where they would be a mere place."""
    here = f'[id="{dom_id(slider)}"]'
    return f"<style>{here} + .mantine-NumberInput-root,{here} .mantine-Slider-label{{display:none}}</style>"
