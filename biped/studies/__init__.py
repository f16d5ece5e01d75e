"""What commands find out: comparison, search for gains, stability, regressions, benchmarks."""
