"""The shapes of a robot: those that are seen, and the solids that touch, from its description."""
