"""Who may come in: the server, sessions, the classroom."""
