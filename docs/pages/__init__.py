"""The generated pages of the documentation: one file per kind of page."""
