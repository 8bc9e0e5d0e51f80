"""URDF import: `canonicalise` for use, `check_urdf` for the report alone."""

from robots.urdf.canonical import Canonical, canonicalise, check_bytes, check_urdf, load_bytes
from robots.urdf.joints import UNBOUNDED

__all__ = ["UNBOUNDED", "Canonical", "canonicalise", "check_bytes", "check_urdf", "load_bytes"]
