"""The kit lessons are made of: steps, claims, predictions, challenges, measures."""
