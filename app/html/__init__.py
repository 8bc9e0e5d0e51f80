"""Words, numbers and colours for people; whatever a user or a file named is escaped here."""
