"""Check a cluster, and report the problems that keep TrainingJobs from running, with their remedies.

`CHECKS` has the order of the checks: causes come before their consequences. The checks are in these modules:

- `check_result`: the result of a check
- `platform`: the cluster: version, CRD, namespace, sidecars and storage
- `installation`: the operator: its replicas, images, leader, rights and metrics
- `rbac`: the permissions of the operator and of users

The checks do not change the cluster; a check that must create an object does a dry run.
"""

from collections.abc import Iterator, Mapping

from palaestra.cluster import ApiError, Forbidden, Untrusted
from palaestra.doctor.check_result import Check, CheckResult, CheckStatus, Site, unknown, wrong
from palaestra.doctor.installation import images, leads, metrics, operator_rights, runs
from palaestra.doctor.platform import answers, definition, namespace, nodes, sidecars, storage
from palaestra.doctor.rbac import own_rights

__all__ = ["CHECKS", "CheckResult", "CheckStatus", "Site", "examine"]

CHECKS: tuple[tuple[str, Check], ...] = (
    ("API server", answers),
    ("nodes", nodes),
    ("TrainingJobs", definition),
    ("namespace", namespace),
    ("your rights", own_rights),
    ("sidecars", sidecars),
    ("storage class", storage),
    ("operator", runs),
    ("images", images),
    ("leader", leads),
    ("operator's rights", operator_rights),
    ("metrics", metrics),
)
# For each check, the checks to skip if it fails. A skipped check would fail too, or its result would mislead.
# For example, RBAC also grants permissions in a namespace that does not exist.
POINTLESS: Mapping[Check, frozenset[Check]] = {
    answers: frozenset(check for _, check in CHECKS),
    namespace: frozenset({own_rights, sidecars, operator_rights}),
}


def examine(site: Site) -> Iterator[CheckResult]:
    """Yield the results of each check; if a check fails, skip the checks that `POINTLESS` has for it."""
    skipped: frozenset[Check] = frozenset()
    for what, check in CHECKS:
        if check in skipped:
            continue
        found = list(_findings(what, check, site))
        yield from found
        if any(finding.verdict is CheckStatus.WRONG for finding in found):
            skipped |= POINTLESS.get(check, frozenset())


def _findings(what: str, check: Check, site: Site) -> Iterator[CheckResult]:
    try:
        yield from check(site)
    except Forbidden as error:
        yield unknown(what, f"you have no permission: {error.message}", "ask a cluster administrator")
    except Untrusted as error:
        yield wrong(what, error.fact, error.remedy)
    except ApiError as error:
        yield wrong(what, str(error), "check the API server and the connection to it")
