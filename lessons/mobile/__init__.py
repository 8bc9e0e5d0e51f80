"""Old place of the events, for scripts exported before version 0.2; no other code uses it."""
