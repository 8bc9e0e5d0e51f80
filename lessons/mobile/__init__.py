"""Where scripts exported before version 0.2 look for events; nothing else does."""
