"""The job of a run: its configuration, its author's code, and the files of its run directory."""
