"""What is taught: scenes, the headless session, lessons and the papers' experiments."""
