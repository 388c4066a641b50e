"""A simulator that is due is recycled between two episodes, and no row becomes invalid."""

from __future__ import annotations

import threading

import structlog

from palaestra_trainer.simulators.restarter import Restarter
from tests.unit.trainer.episodes.walking import walk


def test_a_member_is_recycled_between_episodes_without_a_fault(make_vec_env, make_member):
    """Simulators leak memory, and a planned restart takes less time than a crash."""
    member = make_member(recycle_after=2)
    env = make_vec_env(member)
    env.reset()

    rows = walk(env, 9)

    assert member.log == ["restart"]
    assert all(infos[0]["palaestra"]["valid"] for _, _, _, infos in rows)
    assert member.resets == 2


def test_recycling_is_logged_once_a_minute_with_the_number_of_all(make_member, clock):
    """A line every few seconds would hide other lines; the first line shows that the limits work."""
    restarter = Restarter(make_member(recycle_after=1), clock=clock)

    with structlog.testing.capture_logs() as logs:
        restarter.reset(seed=1)
        for clock.now in (0.0, 5.0, 59.0, 61.0, 62.0, 122.0):
            restarter.reset(seed=1)

    told = [line["times"] for line in logs if line["event"] == "simulator recycled"]
    assert told == [1, 4, 6]


def test_members_are_recycled_at_the_same_time(make_vec_env, make_member):
    """Simulators that start together reach their limits together; one after the other would take longer."""
    both = threading.Barrier(2, timeout=20.0)
    members = [make_member(f"collect-{index}", recycle_after=1) for index in range(2)]
    for member in members:
        member.restart = lambda member=member: (both.wait(), setattr(member, "resets", 0))
    env = make_vec_env(*members)
    env.reset()

    rows = walk(env, 3)

    assert all(info["palaestra"]["valid"] for _, _, _, infos in rows for info in infos)


def test_a_recycling_that_fails_is_a_fault_like_any_other(make_vec_env, make_member):
    """A planned restart may fail too, and then another restart comes before the next episode."""
    member = make_member(starts=[1], recycle_after=1)
    env = make_vec_env(member)
    env.reset()

    rows = walk(env, 5)

    assert member.log == ["restart", "restart"]
    assert [infos[0]["palaestra"]["valid"] for _, _, _, infos in rows] == [True, True, True, False, True]


def test_a_world_is_reloaded_before_each_episode_but_the_first(make_vec_env, make_member):
    """A process that has just started has loaded its world already."""
    member = make_member()
    member.reloads = True
    env = make_vec_env(member)
    env.reset()

    rows = walk(env, 9)

    assert member.log == ["reload"] * (member.resets - 1)
    assert member.resets > 2
    assert all(infos[0]["palaestra"]["valid"] for _, _, _, infos in rows)


def test_a_reload_that_fails_is_a_fault_like_any_other(make_vec_env, make_member):
    """The simulator is restarted, and its new process needs no reload."""
    member = make_member(starts=[1])
    member.reloads = True
    env = make_vec_env(member)
    env.reset()

    rows = walk(env, 5)

    assert member.log[:2] == ["reload", "restart"]
    assert [infos[0]["palaestra"]["valid"] for _, _, _, infos in rows] == [True, True, True, False, True]
