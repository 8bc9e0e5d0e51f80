"""The panels of a lesson: its cards, steps, predictions and claims."""
