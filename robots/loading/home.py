"""Estimates a home configuration and acceleration limits for robots that are not in the
catalog."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.inertia import finite_range, mass_matrix, sample_configurations
from robots.joints import chain_length

_CANDIDATES = 300
_STEPS = 60
_ROOM = 0.125  # height of the frame above the floor, as a share of the reach
_PLAIN = 0.05  # accepted loss of score if a joint is put at the middle of its range
_SINGULAR = 1e-6  # a singular value of J that is smaller counts as zero
_HOLDS = 0.8  # share of an effort limit that holding the robot may use without loss of score


def find_home(
    model: pin.Model,
    frame: int,
    q_lower: np.ndarray,
    q_upper: np.ndarray,
    seed: int = 0,
    least_height: float = -np.inf,
) -> np.ndarray:
    """Returns a configuration (n,), rad, inside the limits and away from singularities and from the limits.

    The configuration maximises log σ_min(J) + log(joint margin) − 0.1‖q − middle‖², first over samples and
    then by random steps; the linear part of J is divided by the reach, and σ_min is the least singular value
    of J and of its linear part that is not zero everywhere, as some are for a planar arm. (With six
    independent joints, that of J is the smaller one.) The result is deterministic. Joints
    that do not move the frame are at the middle of their range (unbounded joints at 0). A chain that reaches
    below the floor (z = 0, or the height of the first joint if lower) gets a lower score, and so does a frame
    that is less than an eighth of the reach above it, or lower than `least_height`, m: one could not drag it
    down. A joint gets a lower score for a posture that its effort limit hardly holds. An elbow above the tip
    gets a higher score.
    """
    lower, upper = finite_range(q_lower, q_upper)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    chain = [int(joint) for joint in model.supports[model.frames[frame].parentJoint] if joint > 0]
    moving = np.unique([model.idx_vs[joint] for joint in chain]).astype(int)
    if len(moving) == 0:
        return middle
    data = model.createData()
    reach = max(chain_length(model, frame), 1e-3)

    pin.forwardKinematics(model, data, middle)
    floor = min(0.0, float(data.oMi[chain[0]].translation[2]))
    least_height = max(least_height, floor + _ROOM * reach)

    def singular_values(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # For a single joint Pinocchio returns the Jacobian as a one-dimensional array.
        J = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, model.nv)
        jacobian = J[:, moving]
        jacobian[:3] /= reach
        return np.linalg.svd(jacobian, compute_uv=False), np.linalg.svd(jacobian[:3], compute_uv=False)

    def score(q: np.ndarray) -> float:
        singular = min(
            float(each[rank - 1]) for each, rank in zip(singular_values(q), ranks, strict=True) if rank
        )
        pin.forwardKinematics(model, data, q)
        tip = pin.updateFramePlacement(model, data, frame)
        heights = [float(data.oMi[j].translation[2]) for j in chain]
        height = float(tip.translation[2])
        lowest = min(height, *heights)
        elbow = min(max(heights) - height, 0.3 * reach) / reach
        margin = float(((half - np.abs(q - middle)) / half)[moving].min())
        bend = float(np.square((q - middle)[moving] / np.pi).mean())
        below = 8.0 * max(0.0, floor - lowest, least_height - height) / reach
        load = np.abs(pin.computeGeneralizedGravity(model, data, q)) / model.effortLimit
        heavy = 8.0 * float(np.clip(load - _HOLDS, 0.0, 1.0).sum())
        easy = float(np.log(singular + 1e-9) + 0.5 * np.log(max(margin, 1e-9)))
        return easy - bend - below - heavy + elbow

    samples = sample_configurations(
        np.maximum(q_lower, middle - np.pi), np.minimum(q_upper, middle + np.pi), _CANDIDATES, seed
    )
    full = np.tile(middle, (_CANDIDATES, 1))
    full[:, moving] = samples[:, moving]
    ranks = np.max([[(each > _SINGULAR).sum() for each in singular_values(q)] for q in full], axis=0)
    best = max((*full, middle), key=score)
    best_score = score(best)
    rng = np.random.default_rng(seed)
    for k in range(_STEPS):
        trial = best.copy()
        step = rng.normal(size=len(moving)) * 0.3 * 0.97**k
        trial[moving] = np.clip(
            best[moving] + step, (middle - 0.9 * half)[moving], (middle + 0.9 * half)[moving]
        )
        trial_score = score(trial)
        if trial_score > best_score:
            best, best_score = trial, trial_score
    for joint in moving:
        trial = best.copy()
        trial[joint] = middle[joint]
        if score(trial) > best_score - _PLAIN:
            best, best_score = trial, score(trial)
    return np.round(best, 3) if np.all(np.abs(np.round(best, 3) - middle) <= half) else best


def sensible_a_max(
    model: pin.Model, q_lower: np.ndarray, q_upper: np.ndarray, tau_limit: np.ndarray
) -> np.ndarray:
    """Returns acceleration limits (n,), rad/s², within [1, 15]: half the acceleration that each joint's
    torque allows in addition to gravity.

    a_i = ½ min over samples of (τ_i − |g_i|)/M_ii. The other half remains for coupling and tracking.
    """
    data = model.createData()
    accelerations = []
    for q in sample_configurations(q_lower, q_upper, 64):
        gravity = np.abs(pin.computeGeneralizedGravity(model, data, q))
        accelerations.append((tau_limit - gravity) / np.diag(mass_matrix(model, data, q)))
    return np.clip(0.5 * np.min(accelerations, axis=0), 1.0, 15.0)
