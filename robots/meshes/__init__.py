"""The mesh files that a description names: their places and their triangles."""
