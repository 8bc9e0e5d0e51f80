"""Limits the time and memory of child processes, and ends them and their descendants."""
