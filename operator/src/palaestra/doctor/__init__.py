"""Check a cluster and report why TrainingJobs do not run in it, with the remedy.

- `check_result`: the result of a check
- `run`: all checks in their order
- `platform`: the cluster: version, CRD, namespace, sidecars and storage
- `installation`: the operator: its replicas, images, leader, rights and metrics
- `rbac`: the permissions of the operator and of users

No check changes anything; a check that must create an object does a dry run.
"""

from palaestra.doctor.check_result import CheckResult, CheckStatus, Site
from palaestra.doctor.run import CHECKS, examine

__all__ = ["CHECKS", "CheckResult", "CheckStatus", "Site", "examine"]
