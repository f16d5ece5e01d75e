"""What every room stands on: errors, files, compiled kernels and their cache, statistics."""
