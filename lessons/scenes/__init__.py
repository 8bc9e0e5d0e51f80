"""Scenes: robot, stack, references and disturbances as data. One catalog contains both kinds of scenes."""
