"""What the panels and the 3D view of one browser tab share."""
