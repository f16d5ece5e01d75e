"""Studies behind the commands: comparison, search for gains, stability, regressions, benchmarks."""
