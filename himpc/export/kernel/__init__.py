"""The functions of an exported controller besides the compiled tick: the sequence of a whole control period,
the fallbacks, dragged targets and settings. They are compiled like the tick and have arrays of their own."""
