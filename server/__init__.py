"""The HTTP render service."""
