"""The lecturer: it knows which step of a lesson is active and judges its run."""
