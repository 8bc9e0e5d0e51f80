"""Lessons in the page: which step is on, how its run is judged, how its texts and pictures are made."""
