"""Many runs: plan, workers, results, sweeps, checks."""
