"""The lecturer, which judges the run of the active step of a lesson."""
