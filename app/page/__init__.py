"""One browser tab: its layout, and the user interface of a torque or a velocity scene."""
