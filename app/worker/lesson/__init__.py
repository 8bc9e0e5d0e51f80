"""The lecturer: which step of a lesson is on, and how its run is judged."""
