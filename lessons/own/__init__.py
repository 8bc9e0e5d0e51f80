"""Files of one's own: a Python file is a controller, a scene, a task or a lesson by what it defines.

Here it is read, judged and loaded; what is made of it stands above."""
