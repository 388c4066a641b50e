"""Sweeps: many trainings that differ in some fields, and the comparison of their results.

- `model`: the Sweep that a person writes, and its parser.
- `grid`: trials from a Sweep; pure.
- `trial`: one trial, and the results (figures) of its runs.
- `search`: the interface for the choice of the next trial, and the choice in the order of a list.
- `optuna_search`: the choice of the next trial by Optuna, which also prunes; imported only if a Sweep uses
  it.
- `trial_log`: the trials that have ended, in a file of the sweep's folder.
- `runner`: the loop over trials, for any backend.
- `local_backend`: trials as processes on this machine.
- `cluster_backend`: trials as TrainingJobs in a cluster.
- `table`: the result as text.
- `plot`: the result as a figure; imported only if it is drawn.
"""
