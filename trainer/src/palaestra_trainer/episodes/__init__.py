"""Play episodes in a run's simulators, to collect rows for learning or to evaluate the policy."""
