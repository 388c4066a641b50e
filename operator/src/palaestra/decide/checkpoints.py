"""Text about the start of a replica's next pod: from a checkpoint, or from step 0."""

from palaestra.decide.replica_context import ReplicaContext

RESUMES = "the next pod resumes from the last checkpoint"
BEGINS = "the next pod starts the run again, because no checkpoint was reported"


def next_pod(situation: ReplicaContext) -> str:
    """Return the text about the start of a replica's next pod; a run resumes only from a reported checkpoint.

    A custom program (`spec.trainer.command`) need not report its checkpoints, so its reported step counts as
    one.
    """
    return RESUMES if has_checkpoint(situation) else BEGINS


def has_checkpoint(situation: ReplicaContext) -> bool:
    """Return whether an attempt of the replica has reported a checkpoint."""
    seen = situation.seen
    polled = seen.polled.status.last_checkpoint if seen.polled is not None else None
    words = (word.last_checkpoint for word in seen.terminations.values())
    own = situation.job.spec.trainer.command and situation.counted.furthest_step
    return bool(situation.old.last_checkpoint or polled or any(words) or own)
