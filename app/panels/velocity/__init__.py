"""Controls and plots of velocity-level scenes."""
