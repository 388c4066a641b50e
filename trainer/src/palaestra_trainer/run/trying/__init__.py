"""Play a few episodes of an environment before training, and report its results, speed and problems."""
