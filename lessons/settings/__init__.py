"""All settings that a learner can change, by path."""
