"""Scene graph to flat IR."""
