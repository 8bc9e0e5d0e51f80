"""The web server: access control, sessions and the classroom."""
