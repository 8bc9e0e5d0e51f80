"""Arms that are driven by torques: their common interface, a simulated arm and a Franka arm."""
