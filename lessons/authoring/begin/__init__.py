"""What `himpc-lab new` writes: short files that already run."""
