"""Tests in a browser that need a page of the iiwa of their own, because they load other robots."""
