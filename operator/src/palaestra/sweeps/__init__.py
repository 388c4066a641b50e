"""Sweeps: many trainings that differ in some fields, and which of them learns best.

- `model`: the Sweep that a person writes, and reading it.
- `grid`: trials from a Sweep; pure.
- `trial`: one trial, and figures of its runs.
- `search`: which trial comes next: all in turn, from a file.
- `optuna_search`: the same by Optuna, which also prunes; imported only if a Sweep asks for it.
- `trial_log`: the trials that have ended, in a file of the sweep's folder.
- `runner`: the loop over trials, on any place.
- `local_backend`: trials as processes of this machine.
- `cluster_backend`: trials as TrainingJobs of a cluster.
- `table`: the result as text.
- `plot`: the result as a picture; imported only if there is one to draw.
"""
