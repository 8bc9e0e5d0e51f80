"""The page in Jupyter: in the launcher of JupyterLab and JupyterHub, and in the cell of a notebook."""
