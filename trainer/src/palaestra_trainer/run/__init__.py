"""Run one attempt: train, evaluate, save, resume after a restart, and end with an exit code."""
