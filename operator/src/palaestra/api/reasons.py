"""Every reason that a condition, a replica or an event may have, and all their sentences.

A reason is one word for programs; its message, with the facts filled in, is a sentence for people: the
fact and the remedy. `meaning` and `remedy` are the rows of docs/operations.md.
"""

from dataclasses import dataclass
from enum import StrEnum

from palaestra.api.lines import flat, one_line

LONGEST_MESSAGE = 1024  # characters, as the API server bounds an event's; ours stay within it everywhere
LONGEST_FACT = 600  # of one fact that comes from elsewhere: the scheduler, a registry, a trainer


class Reason(StrEnum):
    """Why something is as it is, in one word.

    A word that an older release wrote into a status is read as what it is called now.
    """

    ACCEPTED = "Accepted"
    INVALID_SPEC = "InvalidSpec"
    STATUS_UNREADABLE = "StatusUnreadable"
    WORLD_MISSING = "WorldMissing"
    WORLD_INVALID = "WorldInvalid"
    CONFIG_MAP_NOT_FOR_JOBS = "ConfigMapNotForJobs"
    SECRET_MISSING = "SecretMissing"  # noqa: S105 - a reason
    SECRET_NOT_FOR_JOBS = "SecretNotForJobs"  # noqa: S105 - a reason
    CLAIM_MISSING = "ClaimMissing"
    CLAIM_NOT_FOR_JOBS = "ClaimNotForJobs"
    POD_METADATA_NOT_ALLOWED = "PodMetadataNotAllowed"
    NO_KUEUE = "NoKueue"
    NAME_TAKEN = "NameTaken"
    OLD_POD_TERMINATING = "OldPodTerminating"
    PLANNED = "Planned"
    QUEUED = "Queued"
    SUSPENDING = "Suspending"
    SUSPENDED = "Suspended"
    RESUMED = "Resumed"
    STARTING = "Starting"
    TRAINING = "Training"
    DISRUPTED = "Disrupted"
    INTERRUPTED = "Interrupted"
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
    SUCCEEDED = "Succeeded"
    SOME_REPLICAS_FAILED = "SomeReplicasFailed"
    EXPIRED = "Expired"
    EDITED = "Edited"

    @classmethod
    def known(cls, word: str) -> "Reason":
        """Return the reason of this name; an unknown one, as of a newer release, is `JobFailed`."""
        return cls(word) if word in set(cls) else cls.JOB_FAILED

    @classmethod
    def _missing_(cls, value: object) -> "Reason | None":
        return _RENAMED.get(value) if isinstance(value, str) else None


_RENAMED = {"FaultBudgetSpent": Reason.SIMULATOR_BUDGET_SPENT}


# What keeps a job from being planned or resumed until a person acts.
HELD = frozenset(
    {
        Reason.INVALID_SPEC,
        Reason.POD_METADATA_NOT_ALLOWED,
        Reason.NO_KUEUE,
        Reason.WORLD_MISSING,
        Reason.WORLD_INVALID,
        Reason.SECRET_MISSING,
        Reason.CLAIM_MISSING,
        Reason.CONFIG_MAP_NOT_FOR_JOBS,
        Reason.SECRET_NOT_FOR_JOBS,
        Reason.CLAIM_NOT_FOR_JOBS,
    }
)

# What a replica waits for while nothing has ended: the cluster tries again, or a person has to act. The
# metric palaestra_replicas_waiting counts these.
WAITING = (
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
)


@dataclass(frozen=True, slots=True)
class Row:
    """What is said with a reason: `message` has the facts in braces; `warning` is the event's type."""

    message: str
    meaning: str
    remedy: str
    warning: bool = True


ROWS: dict[Reason, Row] = {
    Reason.ACCEPTED: Row(
        "the spec is right and all that it names is there{note}",
        "the job can be planned; the images of this release are fixed for it",
        "nothing",
        warning=False,
    ),
    Reason.INVALID_SPEC: Row(
        "{problem}",
        "the spec says something that cannot be carried out; the message names the field",
        "make a new TrainingJob with the field mended: a spec does not change",
    ),
    Reason.STATUS_UNREADABLE: Row(
        "{problem}; nothing is done with the job; upgrade the operator, or make a new TrainingJob",
        "the status was written by something else than this release, so it is not known which replicas ended",
        "run the release that wrote it, or make a new TrainingJob",
    ),
    Reason.WORLD_MISSING: Row(
        "{field}: {fact}; {remedy} and the job starts",
        "the ConfigMap of a world, or its key, is not there",
        'create it in the job\'s namespace with the label `palaestra.dev/for-jobs: "true"`',
    ),
    Reason.WORLD_INVALID: Row(
        "{problem}",
        "a world is no readable `.wbt` file, or names other files",
        "mend the world; one that came from a ConfigMap is read again by itself",
    ),
    Reason.CONFIG_MAP_NOT_FOR_JOBS: Row(
        '{field}: ConfigMap {name} is not for jobs; label it palaestra.dev/for-jobs: "true"',
        "a job may read only what somebody has opened to jobs",
        "whoever owns the ConfigMap sets the label",
    ),
    Reason.SECRET_MISSING: Row(
        "{field}: there is no Secret {name} here; "
        'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
        "the Secret of a variable is not there",
        'create it in the job\'s namespace with the label `palaestra.dev/for-jobs: "true"`',
    ),
    Reason.SECRET_NOT_FOR_JOBS: Row(
        "{field}: Secret {name} is not for jobs, or the operator may not see that it is; "
        'label it palaestra.dev/for-jobs: "true" and bind the role palaestra-job-secrets in this namespace',
        "a job may read only what somebody has opened to jobs, and only where the operator may look at it",
        "whoever owns the Secret labels it and binds the role `palaestra-job-secrets`: see Secrets below",
    ),
    Reason.CLAIM_MISSING: Row(
        "{field}: there is no PersistentVolumeClaim {name} here; "
        'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
        "the existing claim that the job names is not there",
        'create it in the job\'s namespace with the label `palaestra.dev/for-jobs: "true"`',
    ),
    Reason.CLAIM_NOT_FOR_JOBS: Row(
        '{field}: PersistentVolumeClaim {name} is not for jobs; label it palaestra.dev/for-jobs: "true"',
        "a job may write only where somebody has opened a volume to jobs",
        "whoever owns the claim sets the label",
    ),
    Reason.POD_METADATA_NOT_ALLOWED: Row(
        "{field}: key {key} is not allowed in this cluster; allow it with the chart's value {value}, "
        "or make a new TrainingJob without it",
        "other controllers obey labels and annotations of pods: who may write a TrainingJob and no pod "
        "must not reach them; an installation allows none unless it names them",
        "add the key, or its domain with a `/` at the end, to `jobs.allowedPodLabels` or "
        "`jobs.allowedPodAnnotations` ([install](install.md#what-pods-may-carry)): the job starts then",
    ),
    Reason.NO_KUEUE: Row(
        "spec.scheduling.queueName: this cluster has no Kueue; install it, or make a job without a queue",
        "a queue is named and nothing would ever admit the job",
        "install Kueue, or make a new TrainingJob without `queueName`",
    ),
    Reason.NAME_TAKEN: Row(
        "Job {name} belongs to somebody else{deleting}; remove it or rename this TrainingJob",
        "a Job of another owner has the name of a replica's",
        "wait while it is being deleted; otherwise remove it, or rename the TrainingJob",
    ),
    Reason.OLD_POD_TERMINATING: Row(
        "pod {pod} of an earlier TrainingJob of this name has not ended and mounts claim {claim}; "
        "if node {node} is lost, delete the Node object or taint it node.kubernetes.io/out-of-service",
        "the TrainingJob was made again while a pod of the one before still terminates, as on a lost node, "
        "and both mount the same `existingClaim`: no second pod is made while the first may still write",
        "wait; once the machine is off, `kubectl delete node NODE`, or use another claim",
    ),
    Reason.PLANNED: Row(
        "created {objects}", "the objects of a replica were created", "nothing", warning=False
    ),
    Reason.QUEUED: Row(
        "waits in queue {queue} for Kueue{taken}{why}{again}",
        "Kueue has not admitted the replica yet, or has taken it back; the words after the colon are Kueue's",
        "wait, or change what the message names: see [queues](queues.md#train-in-a-queue)",
        warning=False,
    ),
    Reason.SUSPENDING: Row(
        "pod {pod} saves a checkpoint and ends; {by}",
        "the replica is suspended, and its pod has not ended yet: the checkpoint is not safe before it has. "
        "A job that is resumed meanwhile waits for this pod too",
        "wait for `Suspended` before you take the node or the volume",
        warning=False,
    ),
    Reason.SUSPENDED: Row(
        "suspended by {by}",
        "the pods have ended after a checkpoint; the message says who set `suspend`: the TrainingJob's "
        "`spec.suspend`, or a field manager that changed the Job, such as Kueue. "
        "The operator does not undo what another has set",
        "set `spec.suspend: false`; what another has suspended, it has to resume",
        warning=False,
    ),
    Reason.RESUMED: Row(
        "goes on from the last checkpoint", "the replica is no longer suspended", "nothing", warning=False
    ),
    Reason.STARTING: Row(
        "{what}",
        "the objects are there and nothing trains yet",
        "nothing; after some minutes, `kubectl describe pod` tells what it waits for",
        warning=False,
    ),
    Reason.TRAINING: Row("{what}", "at least one trainer runs", "nothing", warning=False),
    Reason.DISRUPTED: Row(
        "pod {pod} was taken ({words}); the next one goes on from the last checkpoint",
        "an eviction, a preemption, a drain, a lost node or a deletion; "
        "it does not count against `backoffLimit`",
        "nothing; often: ask for nodes that stay",
        warning=False,
    ),
    Reason.INTERRUPTED: Row(
        "the trainer of pod {pod} stopped at a checkpoint ({how}); the next one goes on from there",
        "a signal that nobody has told of, or the ROS master was lost; "
        "it does not count against `backoffLimit`",
        "nothing; often: read `lastAttempt.log` in the status",
        warning=False,
    ),
    Reason.TRAINER_FAILED: Row(
        "{how}",
        "the trainer ended as nobody expects; it is tried again while `backoffLimit` allows",
        "read `lastAttempt.log` in the status",
    ),
    Reason.RETRYING: Row(
        "pod {pod} failed: {how}; another goes on from the last checkpoint",
        "a pod failed and counts against `backoffLimit`",
        "read `lastAttempt.log` in the status, which has the last lines of the trainer",
    ),
    Reason.UNSCHEDULABLE: Row(
        "no node takes pod {pod}: {words}; make room or ask for less",
        "the scheduler finds no node; the words are its own",
        "add nodes, lower `resources`, or look at `nodeSelector` and `tolerations`",
    ),
    Reason.IMAGE_PULL: Row(
        "container {container}: image {image} cannot be pulled ({words}); name one that can",
        "an image does not exist, or the registry refuses it; the kubelet tries again, and before the first "
        "step `startTimeoutSeconds` bounds it",
        "push the image, give `imagePullSecrets`, or name another one in a new TrainingJob",
    ),
    Reason.CONTAINER_REFUSED: Row(
        "container {container}: the node cannot make it ({words}); mend what it names",
        "a program, a key of a Secret or a device that the container needs is not there; "
        "the kubelet tries again, and before the first step `startTimeoutSeconds` bounds it",
        "the words are the kubelet's and name what is missing",
    ),
    Reason.VOLUME_NOT_MOUNTED: Row(
        "pod {pod} waits for a volume: {words}; mend what is named",
        "a claim, a ConfigMap or a Secret cannot be mounted, or another node still holds the volume; "
        "the words are the cluster's",
        "`kubectl describe pvc`; a volume on a lost node comes free when its Node object is deleted",
    ),
    Reason.PODS_REFUSED: Row(
        "no pod can be made: {words}",
        "a quota, LimitRange, Pod Security, webhook or a PriorityClass that is missing refuses a pod "
        "or its claim, in the API server's words",
        "raise the quota, or allow what the message names ([queues and quotas](queues.md#quotas)); "
        "it is tried again by itself",
    ),
    Reason.RESTART_POLICY_DROPPED: Row(
        "pod {pod}: {containers} lost restartPolicy: Always, so that the trainer would wait for ever; "
        "update the webhook or scheduler that rewrites pods",
        "something between operator and kubelet does not know sidecar containers and has dropped the field; "
        "the pod is replaced, at most `backoffLimit` times",
        "update or remove the mutating webhook",
    ),
    Reason.SIDECAR_CRASH_LOOP: Row(
        "container {container} has crashed {times} times ({how}); read its log",
        "a sidecar does not stay up; the kubelet starts it again and again, and while it trains the "
        "trainer's budget of faults ends the run",
        "`kubectl logs POD -c CONTAINER --previous`",
    ),
    Reason.SIMULATOR_START_DEADLINE: Row(
        "{what}; read the simulator's log or raise startDeadlineSeconds",
        "a simulator did not come up within `startDeadlineSeconds`; its trainer tries again, and gives up by "
        "its own budget (`SimulatorBudgetSpent`)",
        "`kubectl logs POD -c sim-GROUP-N`; raise the deadline if it is only slow",
    ),
    Reason.TRAINER_NOT_STARTED: Row(
        "all sidecars of pod {pod} run and the node has not started the trainer for {seconds} s; "
        "update the node's Kubernetes",
        "a kubelet forgets the main container when a sidecar's first start failed (Kubernetes issue 132826); "
        "the pod is replaced, at most `backoffLimit` times",
        "update the nodes to 1.34 or newer",
    ),
    Reason.START_TIMEOUT: Row(
        "{what}",
        "the replica did not reach its first step within `startTimeoutSeconds`, and no other reason explains "
        "the wait",
        "run `kubectl describe pod`; if a start may take longer, raise `startTimeoutSeconds` in a new "
        "TrainingJob",
    ),
    Reason.SIMULATOR_OUT_OF_MEMORY: Row(
        "container {container} was killed for its memory ({limit}, {times} so far); "
        "raise spec.simulators[].resources.limits.memory",
        "a simulator's container needs more memory than its limit; the simulator itself did not crash",
        "raise `spec.simulators[].resources.limits.memory` in a new TrainingJob",
    ),
    Reason.TRAINER_OUT_OF_MEMORY: Row(
        "the trainer was killed for its memory ({limit}, {times} so far); "
        "raise spec.trainer.resources.limits.memory, or lower buffer_size",
        "the trainer needs more than its limit",
        "raise `spec.trainer.resources.limits.memory`, or lower the replay buffer, in a new TrainingJob",
    ),
    Reason.EPHEMERAL_STORAGE: Row(
        "pod {pod} was evicted for its storage ({words}); write less outside of the run directory",
        "the pod wrote more to temporary volumes than its limit, or the node's disk is full",
        "write less to /tmp, or enlarge the volume: `spec.storage.size` when it is ephemeral",
    ),
    Reason.STORAGE_FULL: Row(
        "the volume of the run is full: {words}; free some space, or ask for more with spec.storage.size",
        "the run directory takes no more; the last checkpoint is whole, and from it the run is tried again "
        "while `backoffLimit` allows",
        "delete old runs on the volume, enlarge the claim, or lower `spec.trainer.checkpoint.keep`",
    ),
    Reason.NODE_LOST: Row(
        "pod {pod} was to be gone more than {seconds} s ago and node {node} does not confirm it; "
        "delete the Node object or taint it node.kubernetes.io/out-of-service",
        "the node does not answer; no second pod is made while the first may still write",
        "`kubectl delete node NODE` once the machine is off",
    ),
    Reason.SIMULATOR_HUNG: Row(
        "{what}; read the simulator's log",
        "the trainer waited for a simulator for `stallDeadlineSeconds` (exit code 82); it is tried again "
        "while `backoffLimit` allows",
        "`kubectl logs POD -c sim-GROUP-N`; raise the deadline, in a new TrainingJob, "
        "if a step may take that long",
    ),
    Reason.STALLED: Row(
        "{what}; read the stacks in the trainer's log",
        "no step was learned from for `stallDeadlineSeconds`: the trainer ended itself and is tried again, "
        "or answers all the same, and its pod is replaced, at most `backoffLimit` times",
        "`kubectl logs POD -c trainer`; raise the deadline, in a new TrainingJob, "
        "if a step may take that long",
    ),
    Reason.DEADLINE_EXCEEDED: Row(
        "the job was active for {seconds} s, as long as activeDeadlineSeconds allows; "
        "go on with a new job from the same volume",
        "the time is over; suspended time was not counted",
        "raise `activeDeadlineSeconds` before the end, or make a new TrainingJob",
    ),
    Reason.BACKOFF_LIMIT_SPENT: Row(
        "{pods} pods failed, as many as backoffLimit allows; the last: {how}",
        "retrying has not helped",
        "read the message of the last failure and the trainer's log",
    ),
    Reason.CONFIGURATION_REFUSED: Row(
        "the trainer refuses its configuration (exit code 2): {words}",
        "algorithm, environment and options do not go together; it is not tried again",
        "make a new TrainingJob with the field that the message names mended",
    ),
    Reason.SIMULATOR_BUDGET_SPENT: Row(
        "the simulators broke too often (exit code 80): {words}",
        "a simulator had more than `restart.limit` faults within `restart.withinSeconds`; "
        "it is not tried again",
        "read `lastAttempt.faults` in the status; raise `restart.limit` if faults are to be borne",
    ),
    Reason.DIVERGED: Row(
        "the learner diverged (exit code 81): {words}",
        "an observation or reward of the environment, a loss or a weight is NaN or infinite; "
        "the message names it; it is not tried again",
        "mend the environment or lower the learning rate, in a new TrainingJob; "
        "the last good checkpoint is kept",
    ),
    Reason.NO_PROGRESS: Row(
        "{pods} pods in a row were taken or interrupted without one new step; "
        "ask for nodes that stay, or checkpoint more often",
        "`noProgressLimit`: the cluster takes pods faster than they come forward, or the trainer always "
        "exits with 75",
        "lower `spec.trainer.checkpoint.everySteps`, or use nodes that are not taken away; a program of "
        "your own (`trainer.command`) must report its steps with `palaestra_trainer.report`",
    ),
    Reason.JOB_FAILED: Row(
        "the Job failed: {words}",
        "something else than Palaestra ended the replica's Job; the words are the Job's",
        "`kubectl describe job`",
    ),
    Reason.SUCCEEDED: Row(
        "{what}", "the training is complete", "fetch `model.zip` from the run directory", warning=False
    ),
    Reason.SOME_REPLICAS_FAILED: Row(
        "{failed} of {all} replicas failed; the first: replica {index}, {message}",
        "all replicas have ended and not all succeeded",
        "the reason of each stands in `status.replicas`",
    ),
    Reason.EXPIRED: Row(
        "ended more than {seconds} s ago and is deleted, as ttlSecondsAfterFinished asks",
        "the TrainingJob is deleted; its claims stay unless `retain: Delete`",
        "nothing",
        warning=False,
    ),
    Reason.EDITED: Row(
        "{what} was changed by somebody else: {fact}",
        "an object that the operator made was edited; the operator emits one event for each edit "
        "and does not restore the object",
        "if the edit was a mistake, undo it",
    ),
}


def say(reason: Reason, **facts: object) -> str:
    """Return the message of `reason` with the facts filled in: one line, at most 1024 characters."""
    told = {name: flat(str(fact), LONGEST_FACT) for name, fact in facts.items()}
    return one_line(ROWS[reason].message.format(**told), LONGEST_MESSAGE)
