"""Helps authors of controllers, scenes, tasks and lessons: writes template files and loads lesson files."""
