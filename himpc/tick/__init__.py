"""The compiled tick: computes one control period, from measured state to torque, without creating Python
objects."""
