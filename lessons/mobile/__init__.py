"""Velocity-level scenes: missions for a mobile manipulator, their headless session and its summary."""
