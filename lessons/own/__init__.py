"""Files of one's own: a Python file is a controller, a scene, a task or a lesson by what it defines."""
