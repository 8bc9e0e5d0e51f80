"""Functions that act as a learner in a real Chromium, for tests, benchmarks and the pictures of docs/."""
