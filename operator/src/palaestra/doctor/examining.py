"""All checks, in the order in which one may be the cause of the next."""

from collections.abc import Iterator

from palaestra.cluster import ApiError, Forbidden
from palaestra.doctor.finding import Check, Finding, Site, Verdict, unknown, wrong
from palaestra.doctor.installation import images, leads, metrics, operator_rights, runs
from palaestra.doctor.platform import answers, definition, nodes, sidecars, storage
from palaestra.doctor.rights import own_rights

CHECKS: tuple[tuple[str, Check], ...] = (
    ("API server", answers),
    ("nodes", nodes),
    ("TrainingJobs", definition),
    ("your rights", own_rights),
    ("sidecars", sidecars),
    ("storage class", storage),
    ("operator", runs),
    ("images", images),
    ("leader", leads),
    ("operator's rights", operator_rights),
    ("metrics", metrics),
)


def examine(site: Site) -> Iterator[Finding]:
    """Yield what each check comes to; only the first where the API server does not answer."""
    for what, check in CHECKS:
        found = list(_findings(what, check, site))
        yield from found
        if check is answers and any(each.verdict is Verdict.WRONG for each in found):
            return


def _findings(what: str, check: Check, site: Site) -> Iterator[Finding]:
    try:
        yield from check(site)
    except Forbidden as error:
        yield unknown(what, f"you may not look: {error.message}", "ask somebody who may")
    except ApiError as error:
        yield wrong(what, str(error), "look at the API server and the way to it")
