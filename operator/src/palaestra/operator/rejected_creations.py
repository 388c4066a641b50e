"""The API server's last refusal of an object of a TrainingJob, by a quota, a webhook or RBAC.

No object in the cluster reports a refused creation, so the operator remembers the refusal until the object is
created or no longer needed. After a restart the operator retries, and is refused again.
"""

from collections.abc import Mapping

from palaestra.api.text import one_line
from palaestra.cluster import ApiError, ServerError, TooManyRequests
from palaestra.objects import Key
from palaestra.observe.json_access import MOST_TEXT
from palaestra.operator.bounded_cache import BoundedCache

Denied = Mapping[int | None, ApiError]  # by replica; None: of the whole job

_BY_A_WEBHOOK = "webhook"  # a webhook that does not respond; the API server reports it as an internal error
_BY_A_BUDGET = "disruption budget"  # it keeps the pod; the API server responds with 429, as if busy


class RejectedCreations(BoundedCache[int | None, str]):
    """The API server's messages by TrainingJob and replica; None: about an object of the whole job."""

    def learn(self, key: Key, uid: str, refused: Denied) -> None:
        """Record the refusals of one reconcile; objects without a refusal were created.

        A temporary refusal, such as one from a busy API server, does not change the record.
        """
        before = self.known(key, uid)
        words = {
            replica: one_line(error.message, MOST_TEXT) if _lasting(error) else before.get(replica, "")
            for replica, error in refused.items()
        }
        self.keep(key, uid, {replica: said for replica, said in words.items() if said})


def _lasting(error: ApiError) -> bool:
    """Return whether a refusal stays until a person acts."""
    by_a_webhook = isinstance(error, ServerError) and _BY_A_WEBHOOK in error.message
    by_a_budget = isinstance(error, TooManyRequests) and _BY_A_BUDGET in error.message
    return not error.retryable or by_a_webhook or by_a_budget
