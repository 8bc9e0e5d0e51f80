"""Panels that every scene has: playback, time line, sharing, comparison."""
