"""Helps authors of a controller, scene, task or lesson: writes template files, and loads lessons from files."""
