"""Conversions between rotation vectors, rotation matrices and quaternions."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from robots.arrays import Array

_ORIGIN = np.zeros(3)


def log3(R: Array) -> Array:
    """Returns the rotation vector of R, (3,) rad, ‖·‖ ≤ π."""
    return pin.log3(R)


def exp3(w: Array) -> Array:
    """Returns the rotation matrix (3, 3) of the rotation vector w, rad."""
    return pin.exp3(w)


def quaternion(R: Array) -> Array:
    """Returns the unit quaternion (x, y, z, w) of R, with w ≥ 0."""
    # pin.Quaternion(R) is not used: each call leaks 80 bytes, which is 5 MB per minute of simulation.
    q = pin.SE3ToXYZQUAT(pin.SE3(R, _ORIGIN))[3:]
    return q if q[3] >= 0 else -q


def from_quaternion(xyzw: Array) -> Array:
    """Returns the rotation matrix of a quaternion (x, y, z, w) of any non-zero length."""
    xyzw = np.asarray(xyzw, float)
    near_one = np.ldexp(xyzw, -math.frexp(float(np.abs(xyzw).max()))[1])  # exact; squares stay in range
    x, y, z, w = near_one / math.sqrt(float(near_one.dot(near_one)))
    return pin.Quaternion(w, x, y, z).toRotationMatrix()
