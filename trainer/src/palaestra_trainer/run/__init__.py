"""One attempt of a run: trains, evaluates, saves, rejoins after a restart, and ends with an exit code."""
