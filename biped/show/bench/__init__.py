"""What benchmarks measured, on a terminal."""
