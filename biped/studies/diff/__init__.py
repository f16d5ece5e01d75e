"""Two results compared, paired by seed."""
