"""Finds the mesh files that a description names, and reads their triangles."""
