"""The running operator: the control loop, its observations and its writes.

- `controller`: one reconcile: observe, plan, decide, act, one status write, events
- `observer`: the complete observation of one TrainingJob
- `caches`, `informer`: the watched objects
- `unwatched_facts`: facts that no watch reports: foreign Jobs, refusals, events, Workloads, field managers
- `bounded_cache`: their memory, and the rate at which they are requested
- `world_verdicts`: verdicts on worlds; `fair_queue`: the next job whose worlds are checked
- `world_check_process`, `world_check_main`: the process that checks large worlds
- `crd_check`: the cluster's CustomResourceDefinition, compared with this release's
- `poller`: the trainers' own reports, over the pod network
- `poll_schedule`: the next trainer to poll, chosen so that silent pods do not delay the others
- `poll_targets`: the pods to poll
- `preconditions`: reads before a write, because a cache may be behind
- `executor`, `status_writer`, `fenced_client`: every write to the cluster; none while another operator leads
- `unused_claims`: claims of deleted jobs that were never bound
- `workers`: threads that take keys from the queue
- `metric_definitions`: every metric by name, as data; `metrics`: their values
- `health`, `options`, `run`: the process

The decisions are in `palaestra.plan` and `palaestra.decide`, which are pure; `palaestra.cluster` connects to
the API server.
"""
