"""Tests in a browser that have a page of the iiwa for themselves: they load other robots."""
