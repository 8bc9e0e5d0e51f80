"""Child processes: their limits of time and memory, and how they and their descendants are ended."""
