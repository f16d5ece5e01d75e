"""What a run leaves behind, and what is measured of it."""
