"""Drives a real arm by an exported controller. A separate process runs the control loop. Other processes only
read the loop's rows and send it orders. The loop reads the orders when it has time."""
