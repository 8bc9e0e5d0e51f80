"""Many runs: jobs, sweeps, tuning and the comparison of solvers."""
