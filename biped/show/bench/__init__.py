"""Results of benchmarks, on a terminal."""
