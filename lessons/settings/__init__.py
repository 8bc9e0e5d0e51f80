"""Everything a learner can change, by its path."""
