"""What every scene has: playback, looking back, sharing, comparing."""
