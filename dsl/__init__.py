"""The scene language: source text to scene graph."""
