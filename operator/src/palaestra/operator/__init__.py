"""The running operator: the control loop, its observations and its writes.

- `controller`: one reconcile: observe, plan, decide, act, one status write, events
- `looking`: everything that the operator observes of one TrainingJob
- `caches`, `following`: the watched objects
- `asking`, `admissions`, `hindrances`, `switchers`, `strangers`: facts that no watch reports, read on demand
- `denials`, `memory`, `records`: facts of earlier reconciles, bounded; a restart may lose them
- `checking`: verdicts on worlds; `turns`: whose worlds are checked next
- `apart`, `world_program`: the process that checks large worlds
- `definition`: the cluster's definition of TrainingJobs, compared with this release's
- `poller`: the trainers' own reports, over the pod network
- `schedule`: which trainer to poll next, so that silent pods delay no others
- `trainers`: the pods to poll
- `confirming`: reads before a write, because a cache may lag
- `acting`, `reporting`, `writing`: every write to the cluster; none while another operator leads
- `tidying`: the claims of jobs that are gone, if nothing was ever in them
- `workers`: threads that take keys from the queue
- `families`: every metric by name, as data; `metrics`, `waiting`: their values
- `health`, `logs`, `options`, `run`: the process

`palaestra.plan` and `palaestra.decide`, which are pure, make the decisions; `palaestra.cluster` connects to
the API server.
"""
