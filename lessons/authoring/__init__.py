"""For authors of a controller, scene, task or lesson: files to begin with, and lessons by a file's path."""
