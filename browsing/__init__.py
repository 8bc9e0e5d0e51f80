"""A learner's hands in a real Chromium: what tests, benchmarks and the pictures of docs/ share."""
