"""Kinematics: frames and Jacobians at a control tick, and a robot's tree of joints as tables."""
