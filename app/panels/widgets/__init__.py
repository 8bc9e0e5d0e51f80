"""Controls, charts and windows that all panels share."""
