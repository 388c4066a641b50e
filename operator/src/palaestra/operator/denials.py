"""What the API server said when it last refused an object of a TrainingJob: a quota, a webhook, a right.

Nothing in the cluster tells of an object that could not be made, so the operator remembers it until the
object is made or no longer wanted. One that has just started knows nothing, tries, and is told anew.
"""

import threading
from collections.abc import Mapping

from palaestra.cluster import ApiError, ServerError, TooManyRequests
from palaestra.operator.poller import Key

Denied = Mapping[int | None, ApiError]  # by replica; None: of the whole job

_BY_A_WEBHOOK = "webhook"  # that does not answer: the API server calls it an error of its own
_BY_A_BUDGET = "disruption budget"  # of somebody who wants the pod to stay; the API server calls it busy


class Denials:
    """The refusals of creations, by TrainingJob and replica; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._words: dict[Key, dict[int | None, str]] = {}

    def of(self, key: Key) -> Mapping[int | None, str]:
        """Return the API server's words by replica; None: about an object of the whole job."""
        with self._lock:
            return dict(self._words.get(key, {}))

    def learn(self, key: Key, refused: Denied) -> None:
        """Take what was refused of all that is missing; whatever is not among it was made.

        What passes by itself, as an API server that is busy, changes nothing.
        """
        with self._lock:
            before = self._words.pop(key, {})
            words = {
                replica: error.message if _lasting(error) else before.get(replica, "")
                for replica, error in refused.items()
            }
            if any(words.values()):
                self._words[key] = {replica: said for replica, said in words.items() if said}

    def forget(self, key: Key) -> None:
        """Forget a TrainingJob that is gone."""
        with self._lock:
            self._words.pop(key, None)


def _lasting(error: ApiError) -> bool:
    """Return whether a person has to act."""
    by_a_webhook = isinstance(error, ServerError) and _BY_A_WEBHOOK in error.message
    by_a_budget = isinstance(error, TooManyRequests) and _BY_A_BUDGET in error.message
    return not error.retryable or by_a_webhook or by_a_budget
