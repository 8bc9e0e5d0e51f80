"""Controls and plots of one page, one panel per file."""
