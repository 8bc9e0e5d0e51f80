"""MuJoCo's model of a robot and a world, and the contacts in it. Only this package and the plant import
MuJoCo."""
