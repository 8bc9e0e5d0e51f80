"""What viser does not offer: its private parts behind functions of ours."""
