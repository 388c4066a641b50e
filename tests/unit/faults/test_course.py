"""The fault of a plan occurs once, at the request that the plan names."""

import pytest

from tests.faults.course import Course
from tests.faults.plans import Fault, Kind
from tests.faults.requests import Asked

CREATE = Asked(verb="create", resource="jobs")
PODS = Asked(verb="watch", resource="pods")
GET = Asked(verb="get", resource="jobs", name="job-0")


def test_the_fault_comes_at_the_request_that_it_is_planned_for_and_once():
    """A plan counts the requests of one kind, so the counter must ignore all others."""
    fault = Fault(kind=Kind.DROP, request="write", number=2)
    course = Course(fault)

    assert [course.request(each) for each in (GET, CREATE, GET, CREATE, CREATE)] == [
        None,
        None,
        None,
        fault,
        None,
    ]
    assert course.met == "create jobs"


def test_events_of_watches_are_counted_by_themselves():
    """A watch is a single request, but it delivers many changes."""
    fault = Fault(kind=Kind.CUT, request="change", number=2)
    course = Course(fault)

    course.request(PODS)

    assert [course.change(PODS), course.change(PODS)] == [None, fault]
    assert course.counts == {"watch": 1, "change": 2}


def test_it_is_away_for_as_long_as_the_plan_says():
    """The API server is unavailable from the faulty request until the planned time has passed."""
    now = [0.0]
    course = Course(Fault(kind=Kind.AWAY, request="get", number=1, seconds=3.0), lambda: now[0])
    assert not course.away

    course.request(GET)

    assert course.away
    now[0] = 3.0
    assert not course.away


@pytest.mark.parametrize("asked", [PODS, Asked(verb="update", resource="leases", name="operator")])
def test_watches_and_the_lease_do_not_end_the_quiet(asked):
    """An idle operator also sends these requests, so they do not show that it works."""
    now = [5.0]
    course = Course(None, lambda: now[0])
    course.request(GET)
    now[0] = 9.0

    course.request(asked)

    assert course.quiet_s() == 4.0
