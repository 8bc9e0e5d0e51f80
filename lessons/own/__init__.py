"""Users' files: a Python file is a controller, a scene, a task or a lesson, depending on what it defines.

This package reads, checks and loads such a file; the packages that import this one use the result."""
