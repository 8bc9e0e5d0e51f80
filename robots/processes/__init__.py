"""Child processes: limits on their time and memory, and how they and their descendants are ended."""
