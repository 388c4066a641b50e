"""Granted permissions are used ones, by the API server's own record of the whole run.

This module runs last. The tour uses all permissions of the cluster's operator, whatever other tests ran.
tests/e2e/test_chart.py covers the operator of one namespace and the pods of `helm test`.
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
    # An admission plugin checks this and leaves no record. With OwnerReferencesPermissionEnforcement, as on
    # OpenShift, a request that sets blockOwnerDeletion needs the permission to update the owner's finalizers.
    # The API server of tests/control_plane enables it; without this permission the operator creates nothing
    # there.
    (OPERATOR, Right("palaestra.dev", "trainingjobs/finalizers", "update")),
}
OPENED = Right("", "secrets", "get")  # a person grants it by binding the role in a namespace


@pytest.fixture(scope="module")
def used(cluster, shared):
    """The requests of every service account."""
    recorded(cluster)  # skips before any action
    tour(shared, SYSTEM)
    return recorded(cluster)


def accounts(used):
    """Return namespace and name of all service accounts that sent a request."""
    return {(use.namespace, use.account) for use in used}


def rights(used, namespace, account):
    """Return the permissions of an account that the installation itself granted."""
    mine = [use for use in used if (use.namespace, use.account) == (namespace, account) and use.allowed]
    return {use.right for use in mine if SECRETS_ROLE not in use.reason}


@cache
def roles(namespace):
    """Return the objects of the chart for the cluster, or for one namespace."""
    values = {} if namespace == SYSTEM else {"watchNamespaces": [namespace]}
    text = rendered(values, f"--namespace={namespace}")
    return [each for each in yaml.safe_load_all(text) if each]


def test_every_granted_right_is_used_and_no_other(used):
    """An unused permission is a risk, and a missing one lets a job wait for ever."""
    assert (SYSTEM, OPERATOR) in accounts(used)
    for namespace, account in accounts(used):
        allowed = granted(roles(namespace), namespace, account)
        unseen = {right for whose, right in UNSEEN if whose == account}

        assert rights(used, namespace, account) == allowed - unseen, (namespace, account)


def test_both_modes_and_both_accounts_were_looked_at(used, request):
    """Part of the tests may not have used all of them."""
    if not whole(request.session):
        pytest.skip("not all tests of this folder are run")

    assert {(namespace == SYSTEM, account) for namespace, account in accounts(used)} == {
        (everywhere, account) for everywhere in (True, False) for account in (OPERATOR, TRIAL)
    }


def whole(session):
    """Return whether all tests of this folder run."""
    chosen = session.config.option
    files = set(Path(__file__).parent.glob("test_*.py"))
    return not chosen.keyword and not chosen.markexpr and files <= {item.path for item in session.items}


def test_nobody_else_asks_the_api_server(used):
    """The pods of trainers, simulators and users' programs have no token."""
    assert {account for _, account in accounts(used)} <= {OPERATOR, TRIAL}


def test_nothing_was_asked_for_in_vain_but_what_others_may_open(used):
    """A refusal shows a missing permission, unless a person still has to grant it."""
    allowed = {account: granted(roles(account[0]), *account) for account in accounts(used)}
    refused = {use for use in used if not use.allowed}

    assert {use.right for use in refused if use.right not in allowed[use.namespace, use.account]} <= {OPENED}
