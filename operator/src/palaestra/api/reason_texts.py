"""The texts of all reasons.

The message is a template for facts; the complete message is a sentence with the fact and the remedy.
`meaning` and `remedy` are columns of docs/reference/reasons.md.
"""

from dataclasses import dataclass

from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.text import flat, one_line

LONGEST_FACT = 600  # limit in characters of a fact from another program, such as a scheduler or a registry


@dataclass(frozen=True, slots=True)
class ReasonText:
    """The texts of a reason: `message` is a template, and `warning` selects the event type Warning."""

    message: str
    meaning: str
    remedy: str
    warning: bool = True


ROWS: dict[Reason, ReasonText] = {
    Reason.ACCEPTED: ReasonText(
        "the spec is valid and all objects that it names exist{note}",
        "the spec is valid; the job keeps the images of this release for its whole life",
        "nothing",
        warning=False,
    ),
    Reason.INVALID_SPEC: ReasonText(
        "{problem}",
        "the spec has an invalid value; the message names the field",
        "create a new TrainingJob with a corrected value, because a spec cannot be changed",
    ),
    Reason.STATUS_UNREADABLE: ReasonText(
        "{problem}; the operator ignores the job; upgrade the operator, or create a new TrainingJob",
        "this release cannot read the status that another release or program wrote, so it cannot "
        "determine which replicas have ended",
        "run the release that wrote the status, or create a new TrainingJob",
    ),
    Reason.WORLD_MISSING: ReasonText(
        "{field}: {fact}; {remedy} and the job starts",
        "the ConfigMap of a world, or its key, does not exist",
        'create it in the job\'s namespace with the label `palaestra.dev/for-jobs: "true"`',
    ),
    Reason.WORLD_INVALID: ReasonText(
        "{problem}",
        "a world is not a readable `.wbt` file or model of MuJoCo, or refers to other files",
        "correct the world; the operator reads a changed ConfigMap automatically",
    ),
    Reason.WORLD_TOO_COSTLY: ReasonText(
        "{problem}",
        "the check of a world took more processor time or memory than the operator gives to one world",
        "make the world smaller, or put it into the image and name it with `world.file`, in a new "
        "TrainingJob",
    ),
    Reason.CHECKING_WORLDS: ReasonText(
        "the worlds of the job are checked before anything is created; the large worlds of a namespace are "
        "checked one after the other",
        "the operator checks large worlds in a separate process, for one job of a namespace at a time",
        "nothing; if it takes minutes, other jobs of the namespace come first",
        warning=False,
    ),
    Reason.CONFIG_MAP_NOT_FOR_JOBS: ReasonText(
        '{field}: ConfigMap {name} is not for jobs; label it palaestra.dev/for-jobs: "true"',
        "a job may read only ConfigMaps with the label",
        "ask the owner of the ConfigMap to set the label",
    ),
    Reason.SECRET_MISSING: ReasonText(
        "{field}: Secret {name} does not exist in this namespace; "
        'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
        "the Secret of a variable or of `imagePullSecrets` does not exist",
        'create it in the job\'s namespace with the label `palaestra.dev/for-jobs: "true"`',
    ),
    Reason.SECRET_NOT_FOR_JOBS: ReasonText(
        "{field}: Secret {name} is not for jobs, or the operator has no permission to read its labels; "
        'label it palaestra.dev/for-jobs: "true" and bind the role palaestra-job-secrets in this namespace',
        "a job may use only Secrets with the label, and the operator must be allowed to check it",
        "ask the owner of the Secret to set the label and to bind the role `palaestra-job-secrets`: see "
        "[secrets](../howto/secrets.md)",
    ),
    Reason.CLAIM_MISSING: ReasonText(
        "{field}: PersistentVolumeClaim {name} does not exist in this namespace; "
        'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
        "the claim named in `existingClaim` does not exist",
        'create it in the job\'s namespace with the label `palaestra.dev/for-jobs: "true"`',
    ),
    Reason.CLAIM_NOT_FOR_JOBS: ReasonText(
        '{field}: PersistentVolumeClaim {name} is not for jobs; label it palaestra.dev/for-jobs: "true"',
        "a job may write only to claims with the label",
        "ask the owner of the claim to set the label",
    ),
    Reason.POD_METADATA_NOT_ALLOWED: ReasonText(
        "{field}: key {key} is not allowed in this cluster; allow it with the chart's value {value}, "
        "or create a new TrainingJob without it",
        "other controllers act on labels and annotations of pods, and an author of TrainingJobs may have no "
        "permission to create pods, so a job may set only the keys that the chart's values allow",
        "add the key, or its domain with a `/` at the end, to `jobs.allowedPodLabels` or "
        "`jobs.allowedPodAnnotations` ([install](../howto/install.md#what-pods-may-carry)); "
        "the job then starts",
    ),
    Reason.SCHEDULING_NOT_ALLOWED: ReasonText(
        "{field}: {fact} is not allowed in this cluster; {remedy}",
        "a priority, a runtime class, a toleration or an affinity to other pods affects the pods of other "
        "users, so a job may use only the settings that the chart's values allow",
        "allow the setting by the chart's value that the message names "
        "([install](../howto/install.md#what-pods-may-ask-for)); the job then starts",
    ),
    Reason.NO_KUEUE: ReasonText(
        "spec.scheduling.queueName: this cluster has no Kueue; install it, or create a job without a queue",
        "the job names a queue, but the cluster has no Kueue to admit it",
        "install Kueue, or create a new TrainingJob without `queueName`",
    ),
    Reason.NO_IMAGE: ReasonText(
        "{field}: is missing, and the chart's value images.webots.repository is empty; set one of them",
        "a simulator has the driver `webots` but no image, and the installation has no image of Webots",
        "set the chart's value `images.webots`, or create a new TrainingJob with `spec.simulators[].image`",
    ),
    Reason.NAME_TAKEN: ReasonText(
        "Job {name} belongs to another owner{deleting}; delete it or rename this TrainingJob",
        "a Job of another owner has the name that a replica's Job needs",
        "if the Job is being deleted, wait; otherwise delete the Job, or rename the TrainingJob",
    ),
    Reason.OLD_POD_TERMINATING: ReasonText(
        "pod {pod} of an earlier TrainingJob of this name has not ended and mounts claim {claim}; "
        "if node {node} is lost, delete the Node object or taint it node.kubernetes.io/out-of-service",
        "a pod of a deleted TrainingJob of the same name still terminates, for example on a lost node, and "
        "the two jobs use the same `existingClaim`. The operator creates no second pod while the first may "
        "still write",
        "wait; if the node is lost and its machine is off, run `kubectl delete node NODE`; or use another "
        "claim",
    ),
    Reason.RUN_LOST: ReasonText(
        "{fact}; restore it, or run `palaestra restart {name}` to train from step 0 again",
        "the replica has trained, and its claim does not exist or its run directory is empty; the operator "
        "suspends the replica and creates no new claim, because the replica would train from step 0",
        "restore the claim under its name, or the run directory; after you have restored a run directory, or "
        "to train from step 0 again, run `palaestra restart NAME` ([a lost run](../howto/lost-run.md))",
    ),
    Reason.RUN_RESTARTED: ReasonText(
        "the run that was at step {step} is lost; the annotation palaestra.dev/restart-lost-runs was set, so "
        "the replica resumes from its run directory, or starts at step 0 if the directory is empty",
        "a person set the annotation `palaestra.dev/restart-lost-runs`, to give up a lost run or after "
        "restoring it",
        "nothing",
        warning=False,
    ),
    Reason.PLANNED: ReasonText(
        "created {objects}", "the operator created the objects of a replica", "nothing", warning=False
    ),
    Reason.QUEUED: ReasonText(
        "waits in queue {queue} for Kueue{taken}{why}{again}",
        "Kueue has not admitted the replica yet, or has evicted it; Kueue's own message follows the colon",
        "wait, or change what the message names: see [queues](../howto/queues.md#train-in-a-queue)",
        warning=False,
    ),
    Reason.SUSPENDING: ReasonText(
        "pod {pod} saves a checkpoint and ends; {by}",
        "the replica is suspended and its pod has not ended yet, so the checkpoint may be incomplete; "
        "a job that is resumed now also waits for this pod",
        "wait for `Suspended` before you remove the node or the volume",
        warning=False,
    ),
    Reason.SUSPENDED: ReasonText(
        "suspended by {by}",
        "the pods have ended after a checkpoint. The message names the cause: the TrainingJob's "
        "`spec.suspend`, or a field manager that changed the Job, such as Kueue. "
        "The operator does not undo a change by another field manager",
        "set `spec.suspend: false`; if another field manager suspended the Job, resume it there",
        warning=False,
    ),
    Reason.RESUMED: ReasonText("{what}", "the suspension of the replica has ended", "nothing", warning=False),
    Reason.STARTING: ReasonText(
        "{what}",
        "the objects exist and no trainer has responded yet",
        "nothing; if it takes minutes, run `kubectl describe pod`",
        warning=False,
    ),
    Reason.TRAINING: ReasonText("{what}", "at least one trainer runs", "nothing", warning=False),
    Reason.DISRUPTED: ReasonText(
        "pod {pod} was disrupted ({words}); {next_pod}",
        "an eviction, a preemption, a drain, a lost node or a deletion ended the pod; the disruption does "
        "not count against `backoffLimit`, unless the trainer had no time to save (`TrainerFailed`)",
        "nothing; if it recurs, use non-preemptible nodes",
        warning=False,
    ),
    Reason.INTERRUPTED: ReasonText(
        "the trainer of pod {pod} was interrupted ({how}); {next_pod}",
        "the trainer received an unexplained signal, or lost the ROS master; "
        "the interruption does not count against `backoffLimit`",
        "nothing; if it recurs, read `lastAttempt.log` in the status",
        warning=False,
    ),
    Reason.PROBE_FAILED: ReasonText(
        "the kubelet ended the trainer of pod {pod}, because its {probe} probe failed ({how}); "
        "give the trainer more CPU with spec.trainer.resources, or use a node with less load; {next_pod}",
        "the trainer did not respond to the kubelet for a minute, or did not respond at all within "
        "`startTimeoutSeconds` after its start; the failure counts against `backoffLimit`",
        "raise `spec.trainer.resources.limits.cpu`, request more CPU, or run fewer jobs on the node; "
        "for a slow start raise `startTimeoutSeconds`, in a new TrainingJob",
    ),
    Reason.TRAINER_FAILED: ReasonText(
        "{how}",
        "the trainer failed for an unknown reason; it is retried while `backoffLimit` allows",
        "read `lastAttempt.log` in the status",
    ),
    Reason.RETRYING: ReasonText(
        "pod {pod} failed: {how}; {next_pod}",
        "a pod failed and counts against `backoffLimit`",
        "read the last lines of the trainer's log: `lastAttempt.log` in the status",
    ),
    Reason.UNSCHEDULABLE: ReasonText(
        "no node fits pod {pod}: {words}; free resources or request less",
        "the scheduler finds no node; the message quotes the scheduler",
        "add nodes, lower `resources`, or check `nodeSelector` and `tolerations`",
    ),
    Reason.IMAGE_PULL: ReasonText(
        "container {container}: image {image} cannot be pulled ({words}); push it or name another",
        "an image does not exist, or the registry refuses the pull; the kubelet retries, before the first "
        "step for at most `startTimeoutSeconds`",
        "push the image, set `imagePullSecrets`, or name another image in a new TrainingJob",
    ),
    Reason.CONTAINER_REFUSED: ReasonText(
        "container {container}: the node cannot create it ({words}); provide what is missing",
        "a program, a key of a Secret or a device that the container needs is missing; "
        "the kubelet retries, before the first step for at most `startTimeoutSeconds`",
        "provide what is missing; the message quotes the kubelet",
    ),
    Reason.VOLUME_NOT_MOUNTED: ReasonText(
        "pod {pod} waits for a volume: {words}; fix the cause that is named",
        "a claim, a ConfigMap or a Secret cannot be mounted, or the volume is still attached to another "
        "node; the message quotes the cluster",
        "run `kubectl describe pvc`; a volume of a lost node is detached when the Node object is deleted",
    ),
    Reason.PODS_REFUSED: ReasonText(
        "no pod can be created: {words}{remedy}",
        "the API server refuses a pod or its claim because of a quota, a LimitRange, Pod Security, a webhook "
        "or a missing PriorityClass; the message quotes the API server",
        "raise the quota, or allow what the message names ([queues and quotas](../howto/queues.md#quotas)); "
        "the creation is retried automatically",
    ),
    Reason.RESTART_POLICY_DROPPED: ReasonText(
        "pod {pod}: {containers} lost restartPolicy: Always, so the trainer would wait forever; "
        "update the webhook or scheduler that rewrites pods",
        "a webhook or scheduler does not support sidecar containers and has dropped the field; "
        "the operator replaces the pod, at most `backoffLimit` times",
        "update or remove the mutating webhook",
    ),
    Reason.SIDECAR_CRASH_LOOP: ReasonText(
        "container {container} has crashed {times} times ({how}); read its log",
        "a sidecar crashes repeatedly and the kubelet restarts it; during training, the limit of faults "
        "(`restart.limit`) ends the run",
        "run `kubectl logs POD -c CONTAINER --previous`",
    ),
    Reason.SIMULATOR_START_DEADLINE: ReasonText(
        "{what}; read the simulator's log or raise startDeadlineSeconds",
        "a simulator did not become ready within `startDeadlineSeconds`; the trainer retries until "
        "`restart.limit` is reached (`SimulatorBudgetSpent`)",
        "run `kubectl logs POD -c sim-GROUP-N`; if the simulator is only slow, raise `startDeadlineSeconds` "
        "in a new TrainingJob",
    ),
    Reason.TRAINER_NOT_STARTED: ReasonText(
        "all sidecars of pod {pod} run and the node has not started the trainer for {seconds} s; "
        "update the node's Kubernetes",
        "the kubelet does not start the main container if a sidecar's first start failed (Kubernetes issue "
        "132826); the operator replaces the pod, at most `backoffLimit` times",
        "update the nodes to 1.34.3 or newer",
    ),
    Reason.START_TIMEOUT: ReasonText(
        "{what}",
        "the replica did not make its first step within `startTimeoutSeconds`, and no other reason explains "
        "the wait",
        "run `kubectl describe pod`; if a start may take longer, raise `startTimeoutSeconds` in a new "
        "TrainingJob",
    ),
    Reason.SIMULATOR_OUT_OF_MEMORY: ReasonText(
        "container {container} ran out of memory and was killed ({limit}, {times} so far); "
        "raise spec.simulators[].resources.limits.memory",
        "a simulator's container needs more memory than its limit; the simulator itself did not crash",
        "raise `spec.simulators[].resources.limits.memory` in a new TrainingJob",
    ),
    Reason.TRAINER_OUT_OF_MEMORY: ReasonText(
        "the trainer ran out of memory and was killed ({limit}, {times} so far); "
        "raise spec.trainer.resources.limits.memory, or lower buffer_size",
        "the trainer needs more memory than its limit",
        "raise `spec.trainer.resources.limits.memory`, or lower the replay buffer, in a new TrainingJob",
    ),
    Reason.EPHEMERAL_STORAGE: ReasonText(
        "pod {pod} was evicted because of its ephemeral storage ({words}); "
        "write less to /tmp, or, if the run is ephemeral, raise spec.storage.size",
        "the pod wrote more to temporary volumes than its limit, or the node's disk is full",
        "write less to /tmp; if the run is ephemeral, raise `spec.storage.size` in a new TrainingJob",
    ),
    Reason.STORAGE_FULL: ReasonText(
        "the volume of the run is full: {words}; free some space, or request more with spec.storage.size",
        "the run directory is full; the last checkpoint is complete, and the run is retried from it while "
        "`backoffLimit` allows",
        "delete old runs on the volume, enlarge the claim, or lower `spec.trainer.checkpoint.keep` in a new "
        "TrainingJob",
    ),
    Reason.NODE_LOST: ReasonText(
        "pod {pod} should have ended more than {seconds} s ago and node {node} has not confirmed it; "
        "delete the Node object or taint it node.kubernetes.io/out-of-service",
        "the node does not respond; the operator creates no second pod while the first may still write",
        "once the machine is off, run `kubectl delete node NODE`",
    ),
    Reason.SIMULATOR_HUNG: ReasonText(
        "{what}; read the simulator's log",
        "the trainer waited for a simulator for `stallDeadlineSeconds` (exit code 82); it is retried "
        "while `backoffLimit` allows",
        "run `kubectl logs POD -c sim-GROUP-N`; if a step may take that long, raise the deadline in a new "
        "TrainingJob",
    ),
    Reason.STALLED: ReasonText(
        "{what}; read the stacks in the trainer's log",
        "no environment step for `stallDeadlineSeconds`, so the trainer exits and is retried. If the trainer "
        "still responds, but its step count does not change for two more minutes, the operator replaces its "
        "pod, at most `backoffLimit` times",
        "run `kubectl logs POD -c trainer`; if a step may take that long, raise the deadline in a new "
        "TrainingJob",
    ),
    Reason.DEADLINE_EXCEEDED: ReasonText(
        "the job was active for {seconds} s, as long as activeDeadlineSeconds allows; "
        "continue with a new job on the same volume",
        "the job has used up `activeDeadlineSeconds`; suspended time is not counted",
        "raise `activeDeadlineSeconds` before the end, or create a new TrainingJob",
    ),
    Reason.BACKOFF_LIMIT_SPENT: ReasonText(
        "{pods} pods failed, more than backoffLimit allows; the last: {how}",
        "all retries failed",
        "read the message of the last failure and the trainer's log",
    ),
    Reason.CONFIGURATION_REFUSED: ReasonText(
        "the trainer refuses its configuration (exit code 2): {words}",
        "algorithm, environment and options do not fit together; the trainer is not retried",
        "correct the field that the message names, in a new TrainingJob",
    ),
    Reason.SIMULATOR_BUDGET_SPENT: ReasonText(
        "the simulators failed too often (exit code 80): {words}{memory}",
        "a simulator had more than `restart.limit` faults within `restart.withinSeconds`; "
        "the replica is not retried",
        "if the message names memory, raise `spec.simulators[].resources.limits.memory`; otherwise read "
        "`lastAttempt.faults` in the status; if these faults are acceptable, raise `restart.limit`, in a new "
        "TrainingJob",
    ),
    Reason.DIVERGED: ReasonText(
        "the learner diverged (exit code 81): {words}",
        "an observation or reward of the environment, a loss or a weight is NaN or infinite; "
        "the message names it; the replica is not retried",
        "correct the environment or lower the learning rate, in a new TrainingJob; "
        "the last good checkpoint is kept",
    ),
    Reason.NO_PROGRESS: ReasonText(
        "{pods} pods were disrupted or interrupted since the last new step; "
        "use non-preemptible nodes, or save checkpoints more often",
        "the number of pods that ended without a new step reached `noProgressLimit`: the cluster disrupts "
        "pods before they make progress, or the trainer always exits with 75",
        "use non-preemptible nodes, or lower `spec.trainer.checkpoint.everySteps` in a new TrainingJob; your "
        "own program (`trainer.command`) must report its steps with `palaestra_trainer.report`",
    ),
    Reason.JOB_FAILED: ReasonText(
        "the Job failed: {words}",
        "Kubernetes or another controller ended the replica's Job; the message quotes the Job",
        "run `kubectl describe job`",
    ),
    Reason.KEPT_ALIVE: ReasonText(
        "the trainer of pod {pod} has ended, and container {containers} keeps the pod alive; the operator "
        "ends the pod {seconds} s after the trainer; let the injector add native sidecars, or none",
        "a container that a mesh or an agent has added to the pod still runs after the trainer has ended; "
        "the operator reports the result of the trainer",
        "inject native sidecars or none: see [install](../howto/install.md#containers-that-others-add)",
    ),
    Reason.SUCCEEDED: ReasonText(
        "{what}", "the training is complete", "fetch `model.zip` from the run directory", warning=False
    ),
    Reason.SOME_REPLICAS_FAILED: ReasonText(
        "{failed} of {all} replicas failed; the first: replica {index}, {message}",
        "all replicas have ended and not all succeeded",
        "read the reason of each replica in `status.replicas`",
    ),
    Reason.EXPIRED: ReasonText(
        "ended more than {seconds} s ago and is deleted because of ttlSecondsAfterFinished",
        "the operator deletes the TrainingJob; its claims stay unless `retain` is `Delete`",
        "nothing",
        warning=False,
    ),
    Reason.EDITED: ReasonText(
        "{what} was edited by another field manager: {fact}",
        "an object of the operator was edited; the operator emits an event, and does not restore the object",
        "if the edit was a mistake, undo it",
    ),
}


def say(reason: Reason, **facts: object) -> str:
    """Return the message of `reason` with the facts filled in: one line, at most 1024 characters."""
    words = {name: flat(str(fact), LONGEST_FACT) for name, fact in facts.items()}
    return one_line(ROWS[reason].message.format(**words), LONGEST_MESSAGE)
