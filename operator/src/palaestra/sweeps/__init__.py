"""Sweeps: many trainings that differ in some fields, and which of them learns best.

- `model`: the Sweep that a person writes, and reading it.
- `expanding`: trials from a Sweep; pure.
- `trial`: one trial, and figures of its runs.
- `searching`: which trial comes next: all in turn, from a file.
- `suggesting`: the same by Optuna, which also prunes; imported only if a Sweep asks for it.
- `ledger`: the trials that have ended, in a file of the sweep's folder.
- `carrying_out`: the loop over trials, on any place.
- `here`: trials as processes of this machine.
- `there`: trials as TrainingJobs of a cluster.
- `table`: the result as text.
- `drawing`: the result as a picture; imported only if there is one to draw.
"""
