"""What a run of a robot of any kind leaves behind, and its metrics."""
