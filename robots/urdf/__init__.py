"""URDF import: a description read, checked, repaired and reported."""

from robots.urdf.canonical import Canonical, canonicalise
from robots.urdf.joints import UNBOUNDED
from robots.urdf.read import load_bytes

__all__ = ["UNBOUNDED", "Canonical", "canonicalise", "load_bytes"]
