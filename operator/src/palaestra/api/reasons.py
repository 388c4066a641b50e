"""All reasons of conditions, replicas and events: one word for programs; `reason_texts` has the sentences."""

from enum import StrEnum

# Limit of every message, in characters. The API events.k8s.io/v1 has this limit for a note, in bytes.
LONGEST_MESSAGE = 1024


class Reason(StrEnum):
    """The reason for a state or an event, in one word."""

    ACCEPTED = "Accepted"
    INVALID_SPEC = "InvalidSpec"
    STATUS_UNREADABLE = "StatusUnreadable"
    WORLD_MISSING = "WorldMissing"
    WORLD_INVALID = "WorldInvalid"
    WORLD_TOO_COSTLY = "WorldTooCostly"
    CHECKING_WORLDS = "CheckingWorlds"
    CONFIG_MAP_NOT_FOR_JOBS = "ConfigMapNotForJobs"
    SECRET_MISSING = "SecretMissing"
    SECRET_NOT_FOR_JOBS = "SecretNotForJobs"
    CLAIM_MISSING = "ClaimMissing"
    CLAIM_NOT_FOR_JOBS = "ClaimNotForJobs"
    POD_METADATA_NOT_ALLOWED = "PodMetadataNotAllowed"
    SCHEDULING_NOT_ALLOWED = "SchedulingNotAllowed"
    NO_KUEUE = "NoKueue"
    NO_IMAGE = "NoImage"
    NAME_TAKEN = "NameTaken"
    OLD_POD_TERMINATING = "OldPodTerminating"
    RUN_LOST = "RunLost"
    RUN_RESTARTED = "RunRestarted"
    PLANNED = "Planned"
    QUEUED = "Queued"
    SUSPENDING = "Suspending"
    SUSPENDED = "Suspended"
    RESUMED = "Resumed"
    STARTING = "Starting"
    TRAINING = "Training"
    DISRUPTED = "Disrupted"
    INTERRUPTED = "Interrupted"
    PROBE_FAILED = "ProbeFailed"
    TRAINER_FAILED = "TrainerFailed"
    RETRYING = "Retrying"
    UNSCHEDULABLE = "Unschedulable"
    IMAGE_PULL = "ImagePull"
    CONTAINER_REFUSED = "ContainerRefused"
    VOLUME_NOT_MOUNTED = "VolumeNotMounted"
    PODS_REFUSED = "PodsRefused"
    RESTART_POLICY_DROPPED = "RestartPolicyDropped"
    SIDECAR_CRASH_LOOP = "SidecarCrashLoop"
    SIMULATOR_START_DEADLINE = "SimulatorStartDeadline"
    TRAINER_NOT_STARTED = "TrainerNotStarted"
    START_TIMEOUT = "StartTimeout"
    SIMULATOR_OUT_OF_MEMORY = "SimulatorOutOfMemory"
    TRAINER_OUT_OF_MEMORY = "TrainerOutOfMemory"
    EPHEMERAL_STORAGE = "EphemeralStorage"
    STORAGE_FULL = "StorageFull"
    NODE_LOST = "NodeLost"
    SIMULATOR_HUNG = "SimulatorHung"
    STALLED = "Stalled"
    DEADLINE_EXCEEDED = "DeadlineExceeded"
    BACKOFF_LIMIT_SPENT = "BackoffLimitSpent"
    CONFIGURATION_REFUSED = "ConfigurationRefused"
    SIMULATOR_BUDGET_SPENT = "SimulatorBudgetSpent"
    DIVERGED = "Diverged"
    NO_PROGRESS = "NoProgress"
    JOB_FAILED = "JobFailed"
    KEPT_ALIVE = "KeptAlive"
    SUCCEEDED = "Succeeded"
    SOME_REPLICAS_FAILED = "SomeReplicasFailed"
    EXPIRED = "Expired"
    EDITED = "Edited"

    @classmethod
    def known(cls, word: str) -> "Reason":
        """Return the reason with this name; `JobFailed` if this release does not know the name."""
        return cls(word) if word in set(cls) else cls.JOB_FAILED


# A job with one of these reasons waits for a person: the operator neither plans nor resumes the job.
HELD = frozenset(
    {
        Reason.INVALID_SPEC,
        Reason.POD_METADATA_NOT_ALLOWED,
        Reason.SCHEDULING_NOT_ALLOWED,
        Reason.NO_KUEUE,
        Reason.NO_IMAGE,
        Reason.WORLD_MISSING,
        Reason.WORLD_INVALID,
        Reason.WORLD_TOO_COSTLY,
        Reason.SECRET_MISSING,
        Reason.CLAIM_MISSING,
        Reason.CONFIG_MAP_NOT_FOR_JOBS,
        Reason.SECRET_NOT_FOR_JOBS,
        Reason.CLAIM_NOT_FOR_JOBS,
        Reason.RUN_LOST,
    }
)

# A replica with one of these reasons waits: the cluster retries, or a person must act. The metric
# palaestra_replicas_waiting counts such replicas.
WAITING = (
    Reason.RUN_LOST,
    Reason.NAME_TAKEN,
    Reason.OLD_POD_TERMINATING,
    Reason.PODS_REFUSED,
    Reason.NODE_LOST,
    Reason.RESTART_POLICY_DROPPED,
    Reason.UNSCHEDULABLE,
    Reason.VOLUME_NOT_MOUNTED,
    Reason.IMAGE_PULL,
    Reason.CONTAINER_REFUSED,
    Reason.SIMULATOR_OUT_OF_MEMORY,
    Reason.SIDECAR_CRASH_LOOP,
    Reason.SIMULATOR_START_DEADLINE,
    Reason.TRAINER_NOT_STARTED,
    Reason.KEPT_ALIVE,
)
