"""Granted rights are used rights, by the API server's own record of the whole run.

Comes last. The tour makes it hold for the cluster's operator whatever else was run; the operator of one
namespace, and the pods of `helm test`, are looked at where tests/e2e/test_chart.py has had them.
"""

from functools import cache
from pathlib import Path

import pytest
import yaml

from tests.chart.helm import rendered
from tests.chart.installation import SECRETS_ROLE
from tests.chart.rights import Right, granted
from tests.e2e.audit import recorded
from tests.e2e.namespace import OPERATOR, SYSTEM
from tests.e2e.tour import tour

pytestmark = [pytest.mark.looks_back, pytest.mark.timeout(1200)]

TRIAL = "palaestra-trial"
UNSEEN = {
    # Checked by an admission plugin, which leaves no record. With OwnerReferencesPermissionEnforcement, as on
    # OpenShift, a request that sets blockOwnerDeletion needs the right to update the owner's finalizers.
    # The API server of tests/control_plane enables it; without this right the operator creates nothing there.
    (OPERATOR, Right("palaestra.dev", "trainingjobs/finalizers", "update")),
}
OPENED = Right("", "secrets", "get")  # granted by a person who binds the role for it in a namespace


@pytest.fixture(scope="module")
def used(cluster, shared):
    """What every service account has asked for."""
    recorded(cluster)  # skips before anything is done
    tour(shared, SYSTEM)
    return recorded(cluster)


def accounts(used):
    """Return namespace and name of all service accounts that asked for anything."""
    return {(use.namespace, use.account) for use in used}


def rights(used, namespace, account):
    """Return what an account was allowed by the installation itself."""
    mine = [use for use in used if (use.namespace, use.account) == (namespace, account) and use.allowed]
    return {use.right for use in mine if SECRETS_ROLE not in use.reason}


@cache
def roles(namespace):
    """Return the objects of the chart as the tests have them in a namespace: everywhere, or there alone."""
    values = {} if namespace == SYSTEM else {"watchNamespaces": [namespace]}
    text = rendered(values, f"--namespace={namespace}")
    return [each for each in yaml.safe_load_all(text) if each]


def test_every_granted_right_is_used_and_no_other(used):
    """What nobody uses is an open door; what is missing is a job that waits for ever."""
    assert (SYSTEM, OPERATOR) in accounts(used)
    for namespace, account in accounts(used):
        allowed = granted(roles(namespace), namespace, account)
        unseen = {right for whose, right in UNSEEN if whose == account}

        assert rights(used, namespace, account) == allowed - unseen, (namespace, account)


def test_both_modes_and_both_accounts_were_looked_at(used, request):
    """Some tests alone need not have had them all."""
    if not whole(request.session):
        pytest.skip("not all tests of this folder are run")

    assert {(namespace == SYSTEM, account) for namespace, account in accounts(used)} == {
        (everywhere, account) for everywhere in (True, False) for account in (OPERATOR, TRIAL)
    }


def whole(session):
    """Return whether nothing of this folder was left out."""
    chosen = session.config.option
    files = set(Path(__file__).parent.glob("test_*.py"))
    return not chosen.keyword and not chosen.markexpr and files <= {item.path for item in session.items}


def test_nobody_else_asks_the_api_server(used):
    """No trainer, no simulator, and no program of an author's: their pods hold no token."""
    assert {account for _, account in accounts(used)} <= {OPERATOR, TRIAL}


def test_nothing_was_asked_for_in_vain_but_what_others_may_open(used):
    """A refusal is a right that is missing, unless its holder is still to decide."""
    allowed = {account: granted(roles(account[0]), *account) for account in accounts(used)}
    refused = {use for use in used if not use.allowed}

    assert {use.right for use in refused if use.right not in allowed[use.namespace, use.account]} <= {OPENED}
