"""Controllers to begin with and to read: each file runs as `himpc-lab run SCENE --controller FILE.py`."""
