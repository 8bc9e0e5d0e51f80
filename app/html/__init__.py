"""Text, numbers and colours as HTML. All names that come from a user or a file are escaped here."""
