"""A run that can be repeated: state codes and scripts."""
