"""Ovolo: scenes to pictures, with known accuracy."""
