"""Run the pods of a plan as processes on this machine.

A small kubelet and a small Job controller run the objects that a cluster would get, with a laptop's layout,
by the rules of a cluster. Init sidecars start one after another, each after the startup probe of the previous
one has passed, then the trainer. Containers restart with back-off, and the pod failure policy applies. The
shutdown is in reverse order, within one grace period.

As in a cluster, no process is left behind. A marker in the environment identifies a pod's processes. The
orphan killer ends them when the runner's end of a pipe closes, so they end with the runner, even after
SIGKILL (`orphan_killer`).

A Python program runs a job with `palaestra.run` (`run_handle`). The runner is then a separate process, which
ends with that program (`child_main`).
"""
