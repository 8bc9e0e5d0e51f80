"""A run as data: rows, summary, arrays, tables."""
