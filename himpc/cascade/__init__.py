"""The cascade: one QP per level, strictly ordered."""
