"""Controls and plots of torque-level scenes."""
