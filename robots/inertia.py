"""Suggests M̄ of time-delay estimation and a payload for any robot, and computes a measure of convergence
for a given M̄."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

LARGEST_EIGENVALUE = 1.5
"""λ_max(M⁻¹M̄) of a suggested M̄ over the sampled configurations; the limit of stability is 2."""

_WIDEST = 4.0 * np.pi + 1e-6  # widest sampled range, rad or m; further turns repeat the same configurations


def finite_range(q_lower: np.ndarray, q_upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ends of the ranges in which configurations are sampled: the limits of a joint with two
    limits, ±π for an unbounded joint, and otherwise the only limit and the angle one turn away from it. Of a
    range of more than two turns only the part within ±π is used, or half a turn if it has none."""
    turn = 2.0 * np.pi
    from_above = np.where(np.isfinite(q_upper), q_upper - turn, -np.pi)
    from_below = np.where(np.isfinite(q_lower), q_lower + turn, np.pi)
    lower = np.where(np.isfinite(q_lower), q_lower, from_above)
    upper = np.where(np.isfinite(q_upper), q_upper, from_below)
    wide = upper - lower > _WIDEST
    low = np.maximum(lower, np.minimum(-np.pi, upper - np.pi))
    high = np.minimum(upper, np.maximum(np.pi, low + np.pi))
    return np.where(wide, low, lower), np.where(wide, high, upper)


def sample_configurations(
    q_lower: np.ndarray, q_upper: np.ndarray, samples: int, seed: int = 0
) -> np.ndarray:
    """Returns configurations (samples, n), uniformly distributed inside the limits and, for unbounded joints,
    within ±π."""
    lower, upper = finite_range(q_lower, q_upper)
    return np.random.default_rng(seed).uniform(lower, upper, size=(samples, len(lower)))


def mass_matrix(model: pin.Model, data: pin.Data, q: np.ndarray) -> np.ndarray:
    """Returns M(q), kg·m², symmetric (Pinocchio's `crba` fills the upper triangle only)."""
    if model.njoints - 1 > model.nv:
        data = (
            model.createData()
        )  # for joints that follow others, Pinocchio adds to the result of the last call
    return _symmetric(pin.crba(model, data, q))


def _symmetric(M: np.ndarray) -> np.ndarray:
    """Returns the symmetric matrices that have the given upper triangles, (…, n, n)."""
    return np.where(np.tri(M.shape[-1], k=-1, dtype=bool), M.swapaxes(-1, -2), M)


def sampled_loads(
    model: pin.Model, q_lower: np.ndarray, q_upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the gravity loads |g_i| of 64 samples, (64, n) N·m, and the largest M_ii, (n,) kg·m²."""
    data = model.createData()
    samples = sample_configurations(q_lower, q_upper, 64)
    gravity = np.array([pin.computeGeneralizedGravity(model, data, q) for q in samples])
    inertia = np.array([np.diag(mass_matrix(model, data, q)) for q in samples])
    return np.abs(gravity), inertia.max(axis=0)


def rotor_inertia(model: pin.Model, q_lower: np.ndarray, q_upper: np.ndarray) -> np.ndarray:
    """Returns the reflected rotor inertia, (n,) kg·m² or kg, that a geared robot of this size can have. A
    URDF has no field for it, and without it no constant M̄ suits both a shoulder and a wrist.

    J_i = max(0.1 max M_ii(q), 5 ms · τ_i/v_i), to two digits. The first term is the usual rule for servo
    drives: the load's inertia is at most ten times the rotor's. With the second, the motor alone reaches its
    speed limit in 5 ms at its effort limit. The values of MuJoCo Menagerie and of the PUMA 560 (Armstrong,
    Khatib, Burdick, ICRA 1986) correspond to 2 to 20 ms.
    """
    _, load = sampled_loads(model, q_lower, q_upper)
    least = np.maximum(0.1 * load, 5e-3 * model.effortLimit / model.velocityLimit)
    return np.array([float(f"{value:.1e}") for value in least])


def sensible_payload(
    model: pin.Model, frame: int, q: np.ndarray, tau_limit: np.ndarray, largest: float
) -> float:
    """Returns a mass, kg, that the robot can hold at a frame: a third of what its torque limits leave beside
    gravity at q, at most half the mass that the joints move and at most `largest`, rounded down to 1, 2 or 3
    times a power of ten. A planar robot, on whose joints gravity does not act, gets `largest`.

    m = ⅓ min_i (τ_i − |g_i|) / |Jᵀ a|_i, with the linear Jacobian J of the frame and the gravity a, m/s².
    Robots that cannot hold themselves get 1 g. Files of light arms often give torque limits that no motor of
    this size has; arms that are sold carry at most about half their own mass.
    """
    data = model.createData()
    gravity = np.abs(pin.computeGeneralizedGravity(model, data, q))
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
    per_kg = np.abs(J.T @ model.gravity.linear)
    loaded = per_kg > 1e-6
    held = float(np.min((tau_limit - gravity)[loaded] / per_kg[loaded], initial=math.inf)) / 3.0
    if loaded.any():
        held = min(held, sum(model.inertias[joint].mass for joint in range(1, model.njoints)) / 2.0)
    if held >= largest:
        return largest
    power = 10.0 ** math.floor(math.log10(max(held, 1e-3)))
    return float(f"{power * max(share for share in (1, 2, 3) if share == 1 or share * power <= held):.1g}")


def suggest_M_bar(
    model: pin.Model, q_lower: np.ndarray, q_upper: np.ndarray, samples: int = 200, seed: int = 0
) -> np.ndarray:
    """Returns a constant diagonal M̄, (n,) kg·m², for which time-delay estimation converges on all samples.

    From one period to the next, the estimation error is multiplied by I − M⁻¹M̄, so the spectral radius of
    this matrix must be below 1 (HIMPC, T-RO 2024, Remark 4). M⁻¹M̄ is similar to S = M̄^½ M⁻¹ M̄^½, which is
    symmetric and positive definite, so the eigenvalues are real and positive. The radius is below 1 iff
    λ_max(S) < 2. Steps:

    1. shape: D_i = min over samples of 1/(M⁻¹)_ii, the least inertia of joint i while the other joints are
       free, so each joint gets its own scale, also if the joints have very different sizes;
    2. size: M̄ = LARGEST_EIGENVALUE · D / max over samples of λ_max(D^½ M⁻¹ D^½). Between the samples
       λ(S) is slightly larger: the page of the lesson *Your robot* finds 1.51 on its lamp.

    A larger M̄ improves the estimate and amplifies noise (Remark 4).
    """
    data = model.createData()
    configurations = sample_configurations(q_lower, q_upper, samples, seed)
    stack = np.linalg.inv(np.array([mass_matrix(model, data, q) for q in configurations]))
    shape = 1.0 / np.diagonal(stack, axis1=1, axis2=2).max(axis=0)
    root = np.sqrt(shape)
    largest = np.linalg.eigvalsh(root[:, None] * stack * root[None, :])[:, -1].max()
    return LARGEST_EIGENVALUE * shape / largest


SLOW = 3.0
"""1/s: a robot with less bandwidth needs seconds to reach a target."""


def tracking_bandwidth(M: np.ndarray, M_bar: np.ndarray, T_s: float) -> float:
    """Returns the largest bandwidth, 1/s, of a well-damped loop with time-delay estimation: half the inverse
    of the lag T_s/λ_min(M⁻¹M̄) of its acceleration, to two digits. M is a mass matrix (n, n), M̄ a diagonal
    (n,), kg·m²."""
    root = np.sqrt(M_bar)
    slowest = float(np.linalg.eigvalsh(root[:, None] * np.linalg.inv(M) * root)[0])
    return float(f"{0.5 * slowest / T_s:.2g}")


def convergence_gauge(M: np.ndarray, M_bar: np.ndarray) -> tuple[float, float]:
    """Returns (‖I − M⁻¹M̄‖₂, spectral radius of I − M⁻¹M̄) for a mass matrix M (n, n) and a diagonal M̄ (n,),
    kg·m².

    If the norm is below 1, every error becomes smaller at every step (the paper's condition). If only the
    radius is below 1, errors decay in the end, but may grow first. Raises LinAlgError if M is singular.
    """
    diagonal = np.asarray(M_bar, dtype=float)
    inverse, root = np.linalg.inv(M), np.sqrt(diagonal)
    error = np.eye(len(diagonal)) - inverse * diagonal
    largest = float(np.abs(error).max()) or 1.0
    error /= largest  # scaled: the squares of its elements stay finite
    squares, values = np.linalg.eigvalsh(np.array((error.T @ error, root[:, None] * inverse * root)))
    return largest * math.sqrt(max(float(squares[-1]), 0.0)), float(np.abs(1.0 - values).max())


def convergence_eigenvalues(M: np.ndarray, M_bar: np.ndarray) -> np.ndarray:
    """Returns the eigenvalues of I − M⁻¹M̄, (n,), the largest first. They are the factors by which a step
    multiplies the modes of the error.

    All eigenvalues are real: M⁻¹M̄ is similar to a symmetric matrix. With an eigenvalue near 1 the error
    decays slowly. Below 0, the error changes its sign at every step, and below −1 it grows. Arguments and
    exceptions are those of `convergence_gauge`.
    """
    root = np.sqrt(np.asarray(M_bar, dtype=float))
    return 1.0 - np.linalg.eigvalsh(root[:, None] * np.linalg.inv(M) * root[None, :])
