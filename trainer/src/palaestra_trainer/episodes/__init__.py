"""Plays episodes on a run's simulators, to collect rows that the policy learns from, or to evaluate it."""
