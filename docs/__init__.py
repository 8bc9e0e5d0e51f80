"""The documentation's pictures, and the scripts that take them: `python -m docs.NAME` in a checkout."""
