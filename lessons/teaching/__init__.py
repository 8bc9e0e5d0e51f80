"""The parts of a lesson: steps, claims, predictions, challenges, measures."""
