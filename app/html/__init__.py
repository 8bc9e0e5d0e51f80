"""Text, numbers and colours as HTML; everything that a user or a file named is escaped here."""
