"""The pages that are made from what is there: one file per kind of page."""
