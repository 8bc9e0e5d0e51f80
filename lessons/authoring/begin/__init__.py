"""The template files of `himpc-lab new`: short programs that already run."""
