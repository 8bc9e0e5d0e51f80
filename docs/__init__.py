"""Scripts that make the documentation and its pictures: run `python -m docs.NAME` in a checkout."""
