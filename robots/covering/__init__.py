"""The cover of a robot: capsules that contain its surfaces, and the pairs whose distance is not checked."""
