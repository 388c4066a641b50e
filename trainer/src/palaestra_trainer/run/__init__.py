"""One attempt of a run: trains, evaluates, saves, resumes after a restart, and ends with an exit code."""
