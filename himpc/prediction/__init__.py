"""Prediction: the incremental systems (15) and (18) over the horizon."""
