"""URDF import: reads, checks and repairs a description and reports all changes."""

from robots.urdf.canonical import Canonical, canonicalise
from robots.urdf.joints import UNBOUNDED
from robots.urdf.read import load_bytes

__all__ = ["UNBOUNDED", "Canonical", "canonicalise", "load_bytes"]
