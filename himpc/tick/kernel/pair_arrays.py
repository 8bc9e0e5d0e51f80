"""The arrays of the pairs of a robot's capsules and shapes whose distances are kept. The views that compiled
functions use follow from this table."""

from __future__ import annotations

from collections import namedtuple
from typing import Annotated, NamedTuple

from himpc.compilation.compiled import always_inline_kernel
from himpc.compilation.views import arrays_in, shapes_of, vector
from himpc.tick.kernel.arrays import Array, IntArray


class PairArrays(NamedTuple):
    """The geometry of a robot, the surroundings, and the pairs of a tick; each annotation contains the shape,
    the unit and a description.

    Sizes: n joints; J placements, see `TickArrays`; S capsules; O shapes; P pairs; R pairs that have a row;
    e = n + R unknowns and rows of the QP of a fallback, see `himpc.export.kernel.apart`, and e1 = e + 1.
    """

    # The robot, see `Geometry`.
    rotation: Annotated[Array, "J 3 3", "1", "from the parent joint, at q = 0"]
    translation: Annotated[Array, "J 3", "m", "from the parent joint, at q = 0"]
    axis: Annotated[Array, "J 3", "1", "in the joint's own axes"]
    factor: Annotated[Array, "J", "1", "of a joint that follows another one"]
    carries: Annotated[Array, "J J", "1", "whether the joint of the column carries that of the row"]
    fastest: Annotated[Array, "n", "rad/s", "the largest speeds of the joints"]
    # The surroundings, see `Surroundings`.
    centre: Annotated[Array, "S 3", "m", "start of each capsule's segment"]
    span: Annotated[Array, "S 3", "m", "each capsule's segment"]
    radius: Annotated[Array, "S", "m", "of each capsule"]
    turn: Annotated[Array, "O 3 3", "1", "axes of each shape"]
    middle: Annotated[Array, "O 3", "m", "middle of each shape"]
    half: Annotated[Array, "O 3", "m", "half the edges of a box, and similar numbers"]
    thickness: Annotated[Array, "O", "m", "radius of a shape that is a capsule"]
    velocity: Annotated[Array, "O 3", "m/s", "of each object; zero for the robot's own capsules"]
    shares: Annotated[Array, "O S", "1", "share of d_safe and the margin that each pair keeps"]
    numbers: Annotated[Array, "4", "m, s, m/s²", "d_safe, margin, reaction and deceleration of `Avoidance`"]
    # The pairs of a tick.
    share_of_span: Annotated[Array, "P", "1", "where the nearest point of the segment is"]
    distance: Annotated[Array, "P", "m", "of each pair"]
    normal: Annotated[Array, "P 3", "1", "from the shape to the capsule"]
    slopes: Annotated[Array, "P n", "m/rad", "gradient of each distance"]
    time: Annotated[Array, "P", "s", "in which a pair can come too near"]
    moving: Annotated[Array, "R", "m/s", "the speed at which an object's motion reduces a chosen distance"]
    share: Annotated[Array, "R", "1", "share of d_safe and the margin that a chosen pair keeps"]
    about: Annotated[Array, "3", "m, m/s, 1", "numbers about the pairs, see ROOM"]
    # Scratch.
    placed: Annotated[Array, "1 J 12", "1, m", "placements of the joints"]
    z: Annotated[Array, "1 J 3", "1", "axes of the joints in the world"]
    centres: Annotated[Array, "1 S 3", "m", "starts of the capsules' segments in the world"]
    spans: Annotated[Array, "1 S 3", "m", "the capsules' segments in the world"]
    qp_factor: Annotated[Array, "e e", "1", "Cholesky factor of the Hessian"]
    qp_hessian: Annotated[Array, "e e", "1", "Hessian"]
    qp_gradient: Annotated[Array, "e", "N·m", "linear part of the cost: zero"]
    qp_rows: Annotated[Array, "e e", "1", "rows"]
    qp_lower: Annotated[Array, "e", "N·m", "lower bounds"]
    qp_upper: Annotated[Array, "e", "N·m", "upper bounds"]
    qp_normals: Annotated[Array, "3 e1 e", "1", "scratch of the solver"]
    qp_active: Annotated[Array, "e1 e1", "1", "scratch of the solver"]
    qp_vectors: Annotated[Array, "8 e1", "1", "scratch of the solver"]
    qp_value: Annotated[Array, "e", "N·m", "values of the rows"]
    qp_x: Annotated[Array, "e", "N·m", "the solution"]
    qp_multipliers: Annotated[Array, "e", "1/N·m", "the multipliers"]
    counts: Annotated[IntArray, "6", "1", "the numbers n, J, S, O, P and R"]
    parent: Annotated[IntArray, "J", "1", "parent of each joint"]
    is_revolute: Annotated[IntArray, "J", "1", "kind of each joint"]
    column: Annotated[IntArray, "J", "1", "coordinate that moves each joint"]
    joint: Annotated[IntArray, "S", "1", "the joint that carries each capsule"]
    kind: Annotated[IntArray, "O", "1", "FLOOR, BALL, BOX or CAPSULE"]
    carrier: Annotated[IntArray, "O", "1", "the joint that carries each shape"]
    meets: Annotated[IntArray, "O S", "1", "whether the distance of a pair is checked"]
    knot: Annotated[IntArray, "P", "1", "always 0: one configuration"]
    sphere: Annotated[IntArray, "P", "1", "the capsule of each pair"]
    shape: Annotated[IntArray, "P", "1", "the shape of each pair"]
    chosen: Annotated[IntArray, "R", "1", "the pairs that have a row, the nearest first"]
    link: Annotated[IntArray, "R", "1", "the capsule of each chosen pair, −1 where there is none"]
    other: Annotated[IntArray, "R", "1", "the shape of each chosen pair, −1 where there is none"]
    qp_held: Annotated[IntArray, "3 e1", "1", "scratch of the solver"]
    qp_watched: Annotated[IntArray, "e", "1", "scratch of the solver"]


PAIR_NUMBERS, PAIR_WHOLES = shapes_of(PairArrays, Array), shapes_of(PairArrays, IntArray)
"""The shape of every array, by name: arrays of real numbers, and arrays of whole numbers."""
PairSizes = namedtuple("PairSizes", "n J S O P R e e1")
"""The values of the letters in the shapes, see `PairArrays`."""


def pair_sizes(s: IntArray) -> PairSizes:
    """Returns the values of the letters for the numbers in the array `counts`."""
    return PairSizes(s[0], s[1], s[2], s[3], s[4], s[5], s[0] + s[5], s[0] + s[5] + 1)


_compiled_sizes = always_inline_kernel(pair_sizes)
_pair_arrays = arrays_in(PairArrays, PAIR_NUMBERS, PAIR_WHOLES)


@always_inline_kernel
def pair_arrays_of(data: Array, where: IntArray, whole: IntArray, whole_where: IntArray) -> PairArrays:
    """Returns all arrays as views; the arguments are those of `himpc.tick.kernel.arrays.arrays_of`."""
    return _pair_arrays(data, where, whole, whole_where, _compiled_sizes(vector(whole, whole_where[0], 6)))
