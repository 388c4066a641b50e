"""The running operator: the control loop, its observations and its writes.

- `controller`: one reconcile: observe, plan, decide, act, write the status once, write the events
- `observer`: the complete observation of one TrainingJob
- `caches`, `informer`: the watched objects
- `unwatched_facts`: facts that no watch reports: foreign Jobs, refusals, events, Workloads, field managers
- `bounded_cache`: the memory for these facts, and the rate of the requests for them
- `world_verdicts`: the results of the checks of worlds; `fair_queue`: the order of these checks
- `world_check_process`, `world_check_main`: the process that checks large worlds
- `crd_check`: the cluster's CustomResourceDefinition, compared with this release's
- `poller`: the status of each running trainer, read over the pod network
- `poll_schedule`: the choice of the next trainer to poll, so that silent pods do not delay other pods
- `poll_targets`: the pods to poll
- `preconditions`: reads from the API server before a write, because a cache may be behind
- `executor`, `status_writer`, `fenced_client`: all writes to the cluster, refused while another operator
  leads
- `unused_claims`: deletion of claims that were never bound and whose job was deleted
- `workers`: threads that take keys from the queue
- `metric_definitions`: the definitions of all metrics; `metrics`: their values
- `health`, `options`, `run`: the HTTP server, the options and the start of the process

The decisions are in `palaestra.plan` and `palaestra.decide`, which are pure; `palaestra.cluster` connects to
the API server.
"""
