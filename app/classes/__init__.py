"""A class: a teacher's page, phones that vote, and learners who go through a lesson together."""
