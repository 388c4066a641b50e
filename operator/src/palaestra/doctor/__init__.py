"""Look at a cluster, and tell what keeps TrainingJobs from running in it, with the remedy.

    finding         what a check comes to
    examining       all checks in their order
    platform        the cluster: version, sidecars, storage, the CRD
    installation    the operator: running, leading, its rights, its metrics
    rights          what the operator needs, and what a person does

Nothing is changed: what has to be tried is a dry run.
"""

from palaestra.doctor.examining import CHECKS, examine
from palaestra.doctor.finding import Finding, Site, Verdict

__all__ = ["CHECKS", "Finding", "Site", "Verdict", "examine"]
