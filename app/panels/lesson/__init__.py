"""What a lesson shows: its cards, steps, predictions, claims."""
