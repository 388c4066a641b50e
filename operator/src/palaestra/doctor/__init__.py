"""Check a cluster and report why TrainingJobs do not run in it, with the remedy.

- `finding`: the result of a check
- `examining`: all checks in their order
- `platform`: the cluster: version, sidecars, storage, the CRD
- `installation`: the operator: running, leading, its rights, its metrics
- `rights`: the rights of the operator and of users

Nothing is changed: if a check has to try something, it does a dry run.
"""

from palaestra.doctor.examining import CHECKS, examine
from palaestra.doctor.finding import Finding, Site, Verdict

__all__ = ["CHECKS", "Finding", "Site", "Verdict", "examine"]
