"""The compiled functions of one tick, one file per subject. All of them work on one arena of numbers."""
