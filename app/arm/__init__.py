"""A real arm under an exported controller: a process of its own runs the loop, and whoever watches can only
read its rows and give it orders, which it picks up when it has time."""
