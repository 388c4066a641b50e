"""Play a few episodes of an environment before training: its results, its speed, and its problems."""
