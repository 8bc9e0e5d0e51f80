"""Controls and plots of one page; each file one thing."""
