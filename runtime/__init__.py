"""Flat IR to hits and pictures."""
