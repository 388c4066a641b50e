"""A pod with the ROS master of other pods stays until the last of them is closed."""

from palaestra_trainer.webots.launching.pods_by_master import PodsByMaster


def test_a_pod_stays_while_another_pod_uses_its_master():
    """Without its master, a simulator that a notebook still uses would be lost."""
    pods = PodsByMaster()
    removals = {name: lambda: None for name in ("first", "second", "third")}
    for name, remove in removals.items():
        pods.add(name, "first", remove)

    assert pods.close("first") == []
    assert pods.close("third") == [removals["third"]]
    assert pods.close("second") == [removals["first"], removals["second"]]


def test_a_pod_whose_master_nobody_else_uses_is_removed_at_once():
    """The next simulator then gets a new master."""
    pods = PodsByMaster()
    remove = pods.close  # any function
    pods.add("only", "only", remove)

    assert pods.close("only") == [remove]
