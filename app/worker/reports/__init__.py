"""What a running session tells the page, torque or velocity."""
