"""The operator uses every permission that the installation grants; the audit log of the run must show this.

This module runs last. Its tour uses all permissions of the cluster's operator, so the result does not depend
on other tests. tests/e2e/test_chart.py covers the operator of one namespace and the pods of `helm test`.
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
NOTEBOOKS = "palaestra-jupyter"  # test_pages.py installs a release whose notebooks start simulators
WITH_NOTEBOOKS = {"jupyter": {"enabled": True, "simulators": True, "tokenSecret": {"name": "notebooks"}}}
UNSEEN = {
    # An admission plugin checks this permission without an audit entry. The plugin
    # OwnerReferencesPermissionEnforcement, which OpenShift enables, applies to requests that set
    # blockOwnerDeletion: they need the permission to update the owner's finalizers. The API server of
    # tests/control_plane enables the plugin; without the permission, the operator can create nothing there.
    (OPERATOR, Right("palaestra.dev", "trainingjobs/finalizers", "update")),
}
OPENED = Right("", "secrets", "get")  # an administrator grants it by a RoleBinding in a namespace


@pytest.fixture(scope="module")
def used(cluster, shared):
    """The requests of every service account."""
    recorded(cluster)  # skips the test before any action
    tour(shared, SYSTEM)
    return recorded(cluster)


def accounts(used):
    """Return namespace and name of every service account that sent a request."""
    return {(use.namespace, use.account) for use in used}


def rights(used, namespace, account):
    """Return the permissions that an account used and that the installation granted."""
    mine = [use for use in used if (use.namespace, use.account) == (namespace, account) and use.allowed]
    return {use.right for use in mine if SECRETS_ROLE not in use.reason}


@cache
def roles(namespace):
    """Return the objects of the chart: for the whole cluster, or for one namespace."""
    values = WITH_NOTEBOOKS if namespace == SYSTEM else {"watchNamespaces": [namespace]}
    text = rendered(values, f"--namespace={namespace}")
    return [each for each in yaml.safe_load_all(text) if each]


def test_every_granted_right_is_used_and_no_other(used):
    """An unused permission is a security risk, and without a needed permission a job waits forever."""
    assert (SYSTEM, OPERATOR) in accounts(used)
    for namespace, account in accounts(used):
        allowed = granted(roles(namespace), namespace, account)
        unseen = {right for whose, right in UNSEEN if whose == account}

        assert rights(used, namespace, account) == allowed - unseen, (namespace, account)


def test_both_modes_and_both_accounts_were_looked_at(used, request):
    """The test above loops over accounts in the log, so it would pass without entries of an account."""
    if not whole(request.session):
        pytest.skip("not all tests of this folder are run")

    assert {(namespace == SYSTEM, account) for namespace, account in accounts(used)} == {
        *((everywhere, account) for everywhere in (True, False) for account in (OPERATOR, TRIAL)),
        (True, NOTEBOOKS),
    }


def whole(session):
    """Return whether this run includes all tests of this folder."""
    chosen = session.config.option
    files = set(Path(__file__).parent.glob("test_*.py"))
    return not chosen.keyword and not chosen.markexpr and files <= {item.path for item in session.items}


def test_nobody_else_asks_the_api_server(used):
    """The pods of trainers, simulators and users' programs have no token, so they can send no request."""
    assert {account for _, account in accounts(used)} <= {OPERATOR, TRIAL, NOTEBOOKS}


def test_nothing_was_asked_for_in_vain_but_what_others_may_open(used):
    """A denied request shows a missing permission, except for Secrets, which an administrator must grant."""
    allowed = {account: granted(roles(account[0]), *account) for account in accounts(used)}
    refused = {use for use in used if not use.allowed}

    assert {use.right for use in refused if use.right not in allowed[use.namespace, use.account]} <= {OPENED}
