"""Run the pods of a plan as processes on this machine.

A small kubelet and a small Job controller: the objects are those that a cluster would get, with a
laptop's layout, and what happens to them is what would happen there: init sidecars one after another,
each waiting for its startup probe, then the trainer; restarts with back-off; a pod failure policy;
shutdown in reverse order within one grace period.

What a cluster gives and a laptop does not: that nothing is left behind. A pod's processes are known by
a marker in their environment, and a watchdog ends them when the runner's end of a pipe closes, so they
die with the runner even if it is SIGKILLed (`watchdog`).
"""
