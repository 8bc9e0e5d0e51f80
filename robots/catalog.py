"""The catalog of the project's robots: one URDF per folder, and the data that a URDF cannot contain."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class CatalogEntry:
    """One robot of the catalog. Angles are in degrees, as in the sources."""

    name: str
    title: str
    tip: str
    home_deg: tuple[float, ...]
    a_max: tuple[float, ...]  # rad/s²
    M_bar: tuple[float, ...]  # kg·m²
    hollow: tuple[tuple[str, str], ...] = ()  # pairs of links; in some postures only their hulls touch

    @property
    def path(self) -> Path:
        """The robot's URDF."""
        return _HERE / self.name / f"{self.name}.urdf"

    @property
    def collision_path(self) -> Path:
        """The file with the robot's collision geometry, written by `python -m robots.loading.write`."""
        return _HERE / self.name / "collision.json"

    @property
    def cover_path(self) -> Path:
        """The file with the capsules that distances use, written by the same command."""
        return _HERE / self.name / "cover.json"

    @property
    def home(self) -> np.ndarray:
        """Home configuration, (n,) rad."""
        import numpy as np  # imported here: programs that only list the catalog do not need NumPy

        return np.radians(self.home_deg)


CATALOG: dict[str, CatalogEntry] = {
    entry.name: entry
    for entry in (
        CatalogEntry(
            name="planar3",
            title="Three-joint arm in the horizontal plane (HIMPC paper, section V)",
            tip="ee",
            home_deg=(0.0, 90.0, -90.0),
            a_max=(20.0, 20.0, 20.0),  # project design notes: enough for the viability bound
            M_bar=(0.033, 0.033, 0.033),  # HIMPC paper, section V-A
        ),
        CatalogEntry(
            name="iiwa14",
            title="KUKA LBR iiwa 14 R820, seven joints (HIMPC paper, section VI)",
            tip="flange",
            home_deg=(0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0),  # elbow up, flange pointing down
            a_max=(10.0,) * 7,  # project design notes
            M_bar=(0.1, 0.21, 0.033, 0.042, 0.001, 0.001, 0.0003),  # HIMPC paper, section VI-A
            hollow=(("link_5", "link_7"),),
        ),
        CatalogEntry(
            name="panda",
            title="Franka Emika Panda with hand, seven joints",
            tip="hand_tcp",
            home_deg=(0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0),  # Franka's ready pose
            a_max=(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),  # Franka Control Interface documentation
            M_bar=(0.0275, 0.3, 0.0138, 0.0764, 0.0089, 0.0173, 0.0036),  # suggest_M_bar, two or three digits
        ),
        CatalogEntry(
            name="baxter",
            title="Rethink Robotics Baxter, two arms of seven joints on a fixed pedestal",
            tip="right_gripper",
            # Both grippers point down, 0.37 m apart, in front of the chest.
            home_deg=(
                -5.0,
                -57.0,
                -68.0,
                111.0,
                38.0,
                59.0,
                -29.0,
                5.0,
                -57.0,
                68.0,
                111.0,
                -38.0,
                59.0,
                29.0,
            ),
            a_max=(4.0, 2.0, 8.0, 8.0, 15.0, 15.0, 15.0) * 2,  # our estimate from the joints' torques
            M_bar=(0.046, 0.46, 0.0144, 0.0736, 0.0046, 0.0127, 0.0004) * 2,  # suggest_M_bar
            hollow=tuple(
                (f"{side}_{first}", f"{side}_{second}")
                for side in ("left", "right")
                for first, second in (("upper_shoulder", "upper_elbow"), ("upper_elbow", "upper_forearm"))
            ),
        ),
        CatalogEntry(
            name="ridgeback-ur10",
            title="Clearpath Ridgeback with a UR10, nine joints (HTMPC paper, section V)",
            tip="tool",
            home_deg=(0.0, 0.0, 0.0, 90.0, -45.0, 90.0, -45.0, 90.0, 75.06),  # project design notes
            # project design notes; base m/s², m/s², rad/s²
            a_max=(2.5, 2.5, 1.0, 2.16, 2.16, 3.15, 3.2, 3.2, 3.2),
            M_bar=(130.0, 130.0, 7.9, 0.228, 0.66, 0.152, 0.0078, 0.0037, 0.0003),  # suggest_M_bar
            hollow=(("forearm", "wrist_2"),),
        ),
    )
}
