"""The running operator: the loop, and what it needs to see and to act.

    controller   read, plan, create what is missing, observe, decide, act, one status write, events
    reading      what the caches hold of one TrainingJob
    sources      what a job refers to, fetched on demand
    poller       the trainers' own word, over the pod network
    schedule     which trainer is asked next, so that silent pods cost nobody else a turn
    trainers     which pods are asked
    writing      every write to the cluster; none while another operator leads
    workers      threads that take keys from the queue
    families     every metric by name, as data
    metrics, health, logs, run

What is wanted and what it means is decided elsewhere, in `palaestra.plan` and `palaestra.decide`,
which are pure; how a cluster is spoken to, in `palaestra.cluster`.
"""
