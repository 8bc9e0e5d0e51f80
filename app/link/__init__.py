"""What crosses the boundary between page and simulation: messages, the scene chosen, ring, process."""
