"""Check a cluster and report why TrainingJobs do not run in it, with the remedy.

- `finding`: the result of a check
- `examining`: all checks in their order
- `platform`: the cluster: version, CRD, namespace, sidecars and storage
- `installation`: the operator: its replicas, images, leader, rights and metrics
- `rights`: the rights of the operator and of users

No check changes anything; a check that must create an object does a dry run.
"""

from palaestra.doctor.examining import CHECKS, examine
from palaestra.doctor.finding import Finding, Site, Verdict

__all__ = ["CHECKS", "Finding", "Site", "Verdict", "examine"]
