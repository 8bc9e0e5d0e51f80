"""A real arm under an exported controller. A separate process runs the loop. Other processes only read its
rows and send it orders, and the loop reads the orders when it has time."""
