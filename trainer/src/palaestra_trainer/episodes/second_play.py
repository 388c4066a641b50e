"""Play a chosen episode of an evaluation a second time, to record it in three dimensions.

A recording is kept only if the robot drives exactly as in the evaluation. Otherwise the recording would show
an episode that was not evaluated.
"""

from __future__ import annotations

from collections.abc import Sequence

from palaestra_trainer.episodes.evaluation import ActingPolicy, Episode, play
from palaestra_trainer.episodes.film import Filming
from palaestra_trainer.episodes.scene_film import NotFilmed, SceneFilm, SceneFilming
from palaestra_trainer.errors import Diverged, FaultBudgetSpent, SimulatorFault
from palaestra_trainer.simulators.interface import Viewed
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.check import Check, go_on


def record_again(
    policy: ActingPolicy,
    restarters: Sequence[Restarter],
    game: tuple[int, Episode],
    check: Check = go_on,
) -> SceneFilm:
    """Return the recording of an episode in three dimensions.

    Args:
        policy: the policy that played the episode.
        restarters: the evaluating simulators; the first one that is up plays the episode.
        game: the number of the episode in its evaluation, and the episode.
        check: called before each step; it raises to cancel the recording.

    Raises:
        NotFilmed: the simulator failed or does not describe its world, or the second play differs.
    """
    number, episode = game
    restarter = _ready(restarters)
    member = restarter.member
    if not isinstance(member, Viewed):
        raise NotFilmed("the simulator does not describe its world")
    above, scene = Filming(member), SceneFilming(member)

    def look() -> None:
        above.look()
        scene.look()

    rewards: list[float] = []
    try:
        again = play(policy, restarter, (number, episode.seed), check, rewards, look)
    except SimulatorFault as fault:
        restarter.begin_restart(fault, len(rewards))
        raise NotFilmed(f"the simulator failed in the recording: {fault}") from fault
    except Diverged as error:
        raise NotFilmed(str(error)) from error
    seen, before = above.film(), episode.film
    if again != episode or (seen and seen.poses) != (before and before.poses):
        raise NotFilmed("when the episode was played again for the recording, the robot drove differently")
    return scene.film()


def _ready(restarters: Sequence[Restarter]) -> Restarter:
    """Return the first restarter whose simulator is up."""
    for restarter in restarters:
        try:
            if not restarter.lost and restarter.up():
                return restarter
        except (FaultBudgetSpent, SimulatorFault):  # the next evaluation reports it
            continue
    raise NotFilmed("no simulator was up for the recording")
