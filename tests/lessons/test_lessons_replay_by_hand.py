"""The file of a run is sufficient to compute every torque again: NumPy alone repeats each tick, without code
of the lab."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.__main__ import main

TICKS = 300


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The file that the command line writes for RT1, with one knot and coarse encoders."""
    folder = tmp_path_factory.mktemp("replay")
    what = [
        "--set",
        "horizon=1",
        "--set",
        "plant.encoder_resolution_deg=0.0005",
        "--duration",
        f"{TICKS / 1e3}",
    ]
    path = folder / "run.npz"
    assert main(["run", "planar3-circle", *what, "--npz", str(path), "--json", str(folder / "run.json")]) == 0
    with np.load(path) as found:
        return dict(found)


def test_every_torque_follows_from_the_file(file: dict[str, Any]) -> None:
    """The demanded torque of each tick follows from (28), (31) and the null space (33), written out for the
    planar arm."""
    told = json.loads(str(file["settings"]))["in_force"]
    T, M_bar = told["T_s"], np.array(told["M_bar"]) * told["M_bar_scale"]
    q, v = file["q_measured"], file["v_measured"]
    assert not np.array_equal(q, file["q"]), "the encoders are to be seen in what was measured"
    for k in range(TICKS - 1):
        before = max(k - 1, 0)
        delta = np.zeros(3)
        Z = np.eye(3)
        for level, name in zip(told["levels"], ("position", "q1"), strict=True):
            K_p, K_v, Q, R = (*(level["tasks"][0][gain] for gain in ("K_p", "K_v")), level["Q"], level["R"])
            J, J_before = jacobian(q[k])[name], jacobian(q[before])[name]
            speed = J @ v[k]
            acceleration = (speed - J_before @ v[before]) / T
            x, x_d, x_d_next = file[f"x/{name}"][k], file[f"x_d/{name}"][k], file[f"x_d/{name}"][k + 1]
            free = (1 + K_v * T) * acceleration + (K_v + K_p * T) * speed + K_p * (x - x_d)
            free -= file[f"a_d/{name}"][k + 1] + K_v * file[f"v_d/{name}"][k + 1] + K_p * (x_d_next - x_d)
            pushed = (1 + K_v * T) * J / M_bar
            A, H = pushed @ Z, Q * pushed.T @ pushed + R * np.eye(3)
            gradient = Q * pushed.T @ (free + pushed @ delta) + R * delta
            delta = delta - Z @ np.linalg.solve(Z.T @ H @ Z, Z.T @ gradient)
            Z = Z @ np.linalg.svd(A)[2][len(A) :].T
        np.testing.assert_allclose(file["tau_0"][k] + delta, file["tau_demand"][k], rtol=0, atol=1e-9)


def test_what_acted_is_what_acts_next(file: dict[str, Any]) -> None:
    """τ₀ of a tick is the torque that was applied in the previous tick; in the first tick τ₀ is finite."""
    np.testing.assert_array_equal(file["tau_0"][1:], file["tau"][:-1])
    assert np.isfinite(file["tau_0"][0]).all()


def test_no_bound_was_near(file: dict[str, Any]) -> None:
    """All bounds are far away, because the recomputation omits them. This includes the velocity bound near
    the limit of a joint, which is computed from the constants in the file."""
    q, v, a, t = file["q_measured"], file["v_measured"], file["a_max"], float(file["position_reaction"])
    room = np.minimum(file["q_upper"] - q, q - file["q_lower"]) - float(file["position_margin"])
    reach = np.minimum(file["v_limit"], a * (np.sqrt(t**2 + 2 * room / a) - t))
    assert (np.abs(v) < 0.9 * reach).all()
    assert (np.abs(file["tau_demand"]) < 0.9 * file["tau_upper"]).all()


def test_a_file_names_what_else_it_stands_on(file: dict[str, Any]) -> None:
    """The file contains the frame of tasks that do not name one, and the constants of the position bound."""
    assert str(file["tip"]) == "ee"
    assert float(file["position_reaction"]) == pytest.approx(1e-3 + 5 / 15)
    assert float(file["position_margin"]) > 0
    assert float(file["position_return_rate"]) > 0


def test_at_velocity_level_too(tmp_path: Path) -> None:
    """At velocity level τ₀ is the previous command, and the measured joint angles differ from the true ones
    by the noise."""
    path = tmp_path / "run.npz"
    noisy = ["--set", "plant.position_noise=0.001", "--duration", "1"]
    what = ["run", "ridgeback-ur10-square", *noisy, "--npz", str(path), "--json", str(tmp_path / "run.json")]
    assert main(what) == 0
    with np.load(path) as found:
        np.testing.assert_array_equal(found["tau_0"][1:], found["tau"][:-1])
        assert 1e-5 < np.abs(found["q"] - found["q_measured"]).max() < 0.01
        assert np.isnan(found["position_margin"])
        assert found["a_max"].shape == (9,)


def jacobian(q: np.ndarray) -> dict[str, np.ndarray]:
    """Returns the Jacobians of the tip of three links of 0.3 m in the plane, and of joint 1."""
    angle = np.cumsum(q)
    x, y = 0.3 * np.cos(angle), 0.3 * np.sin(angle)
    hand = np.array([[-y[joint:].sum() for joint in range(3)], [x[joint:].sum() for joint in range(3)]])
    return {"position": hand, "q1": np.array([[1.0, 0.0, 0.0]])}
