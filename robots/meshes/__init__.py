"""The mesh files that a description names: where they are, and their triangles."""
