"""Example controllers: each file runs as `himpc-lab run SCENE --controller FILE.py`."""
