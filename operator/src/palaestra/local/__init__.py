"""Run the pods of a plan as processes on this machine.

A small kubelet and a small Job controller run the objects of a plan with a laptop's layout, by the rules of a
cluster. The sidecars start one after another, each after the startup probe of the previous sidecar has
passed. The trainer starts last. Containers restart with back-off, and the pod failure policy applies. The
shutdown is in reverse order, within one grace period.

As in a cluster, no process is left behind. A marker in the environment identifies a pod's processes. The
orphan killer (`orphan_killer`) ends these processes when the runner's end of a pipe closes. So the processes
end with the runner, even if SIGKILL ends the runner.

A Python program runs a job with `palaestra.run` (`run_handle`). Then the runner is a separate process
(`child_main`), which ends with that program.
"""
