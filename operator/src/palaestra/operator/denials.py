"""What the API server said when it last refused an object of a TrainingJob: a quota, a webhook, a right.

Nothing in the cluster reports an object that could not be made, so the operator remembers it until the
object is made or no longer wanted. An operator that has just started tries, and is refused anew.
"""

from collections.abc import Mapping

from palaestra.api.lines import one_line
from palaestra.cluster import ApiError, ServerError, TooManyRequests
from palaestra.observe.reading import MOST_TEXT
from palaestra.operator.memory import Memory
from palaestra.operator.poller import Key

Denied = Mapping[int | None, ApiError]  # by replica; None: of the whole job

_BY_A_WEBHOOK = "webhook"  # that does not answer: the API server calls it an error of its own
_BY_A_BUDGET = "disruption budget"  # of somebody who wants the pod to stay; the API server calls it busy


class Denials(Memory[int | None, str]):
    """The API server's words by TrainingJob and replica; None: about an object of the whole job."""

    def learn(self, key: Key, uid: str, refused: Denied) -> None:
        """Take what was refused of all that is missing; whatever is not among it was made.

        What passes by itself, as an API server that is busy, changes nothing.
        """
        before = self.known(key, uid)
        words = {
            replica: one_line(error.message, MOST_TEXT) if _lasting(error) else before.get(replica, "")
            for replica, error in refused.items()
        }
        self.keep(key, uid, {replica: said for replica, said in words.items() if said})


def _lasting(error: ApiError) -> bool:
    """Return whether a person has to act."""
    by_a_webhook = isinstance(error, ServerError) and _BY_A_WEBHOOK in error.message
    by_a_budget = isinstance(error, TooManyRequests) and _BY_A_BUDGET in error.message
    return not error.retryable or by_a_webhook or by_a_budget
