"""The mesh files that a description names: finds them and reads their triangles."""
