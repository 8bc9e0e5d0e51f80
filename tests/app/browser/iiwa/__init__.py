"""Tests in a browser that share one page of the iiwa."""
