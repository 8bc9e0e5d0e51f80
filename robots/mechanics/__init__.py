"""The door to MuJoCo besides the plant itself: its model of a robot and a world, and the contacts in it."""
