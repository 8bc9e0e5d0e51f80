"""Actions of a learner in a real Chromium, for tests, benchmarks and the pictures of docs/."""
