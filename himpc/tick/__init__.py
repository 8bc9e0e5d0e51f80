"""The compiled tick: one control period from measured state to torque, without an object in between."""
