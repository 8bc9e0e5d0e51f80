"""The shapes of a robot from its description: visual shapes, and solids for contacts."""
