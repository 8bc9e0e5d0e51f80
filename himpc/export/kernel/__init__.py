"""What an exported controller adds to the compiled tick: the sequence of a whole control period, the
fallbacks, dragged targets and settings, compiled from the same language and on arrays of its own."""
