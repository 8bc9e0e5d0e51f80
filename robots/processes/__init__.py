"""Child processes: limits their time and memory, and ends them and their descendants."""
