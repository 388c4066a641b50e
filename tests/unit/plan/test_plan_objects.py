"""The objects of a replica: their kinds, names and properties."""

import pytest
import yaml

from palaestra.plan import ClusterLayout, Images, LocalLayout, PlanError, plan

LAYOUT = ClusterLayout(images=Images.of_release("1"))


def pod(planned, replica=0):
    """Return the pod spec of a replica."""
    return planned.replicas[replica].job["spec"]["template"]["spec"]


def test_a_job_is_a_policy_and_for_each_replica_a_config_map_a_claim_and_a_job(in_cluster):
    """The operator creates objects in this order.

    A pod never exists before its policy, and it waits for its volumes.
    """
    kinds = [each["kind"] for each in in_cluster(replicas=2).objects]

    assert kinds == ["NetworkPolicy", *["ConfigMap", "PersistentVolumeClaim", "Job"] * 2]


def test_names_are_deterministic_and_no_two_objects_of_a_kind_share_one(in_cluster):
    """A second plan has the same names, so the API server rejects a second creation of the same object."""
    first, second = in_cluster(replicas=3), in_cluster(replicas=3)
    names = [(each["kind"], each["metadata"]["name"]) for each in first.objects]

    assert first == second
    assert len(set(names)) == len(names)


def test_the_name_of_a_config_map_follows_from_its_content(in_cluster):
    """A ConfigMap is never changed, so a new content needs a new name."""
    names = {in_cluster(seed=seed).replicas[0].config_map["metadata"]["name"] for seed in (1, 2)}

    assert len(names) == 2


def test_objects_go_with_the_job_and_the_claim_stays(in_cluster):
    """The deletion of a TrainingJob must not delete its results, unless `retain: Delete` asks for it."""
    replica = in_cluster().replicas[0]

    assert replica.job["metadata"]["ownerReferences"][0]["controller"]
    assert replica.config_map["metadata"]["ownerReferences"]
    assert "ownerReferences" not in replica.claim["metadata"]


def test_a_claim_that_is_not_retained_goes_with_the_job(in_cluster):
    """With `retain: Delete` the claim has an owner reference, so Kubernetes deletes it with the job."""
    claim = in_cluster(storage={"retain": "Delete"}).replicas[0].claim

    assert claim["metadata"]["ownerReferences"][0]["kind"] == "TrainingJob"


def test_a_job_that_is_made_again_gets_a_new_claim(valid_job):
    """The claim's name contains the uid.

    A new job of the same name therefore does not resume the deleted job's run.
    """
    claims = {plan(valid_job(uid=uid), LAYOUT).replicas[0].claim["metadata"]["name"] for uid in "ab"}

    assert len(claims) == 2


@pytest.mark.parametrize(
    ("storage", "volume"),
    [
        ({"ephemeral": True, "size": "2Gi"}, {"emptyDir": {"sizeLimit": "2Gi"}}),
        ({"existingClaim": "mine"}, {"persistentVolumeClaim": {"claimName": "mine"}}),
    ],
)
def test_no_claim_is_made_where_none_is_wanted(in_cluster, storage, volume):
    """An existing claim belongs to its user, and an ephemeral run needs no claim."""
    planned = in_cluster(storage=storage)

    assert planned.replicas[0].claim is None
    assert {"name": "run", **volume} in pod(planned)["volumes"]


def test_a_claim_has_the_size_and_class_of_the_job(in_cluster):
    """A replay buffer of images needs more than the default size."""
    claim = in_cluster(storage={"size": "5Gi", "storageClassName": "fast"}).replicas[0].claim

    assert claim["spec"]["resources"] == {"requests": {"storage": "5Gi"}}
    assert claim["spec"]["storageClassName"] == "fast"


def test_the_end_of_the_trainer_decides_and_always_by_name(in_cluster):
    """A rule without a container name would match the exit codes of sidecars too, and hide the trainer's."""
    rules = in_cluster().replicas[0].job["spec"]["podFailurePolicy"]["rules"]

    assert [rule["action"] for rule in rules] == ["Ignore", "Ignore", "FailJob"]
    assert rules[0]["onPodConditions"] == [{"type": "DisruptionTarget", "status": "True"}]
    assert [rule["onExitCodes"]["values"] for rule in rules[1:]] == [[75], [2, 80, 81]]
    assert {rule["onExitCodes"]["containerName"] for rule in rules[1:]} == {"trainer"}


def test_one_pod_at_a_time(in_cluster):
    """Two pods of one replica would write to the same run directory."""
    spec = in_cluster(backoffLimit=5).replicas[0].job["spec"]

    assert spec["podReplacementPolicy"] == "Failed"
    assert spec["template"]["spec"]["restartPolicy"] == "Never"
    assert spec["backoffLimit"] == 5


def test_a_queued_job_leaves_suspension_to_kueue(in_cluster):
    """The Job is created suspended, so that no pod starts before Kueue has admitted the job."""
    queued = in_cluster(scheduling={"queueName": "robots"}).replicas[0].job
    own = in_cluster(suspend=True).replicas[0].job

    assert queued["metadata"]["labels"]["kueue.x-k8s.io/queue-name"] == "robots"
    assert queued["spec"]["suspend"] is True
    assert own["spec"]["suspend"] is True


def test_a_job_without_a_uid_has_no_plan(valid_job):
    """Without a uid, names and owner references would refer to no object."""
    job = valid_job()
    nobody = job.model_copy(update={"metadata": job.metadata.model_copy(update={"uid": None})})

    with pytest.raises(PlanError, match=r"^metadata.uid: "):
        plan(nobody, LAYOUT)


def test_each_replica_goes_on_from_the_replica_of_the_other_job_with_its_number(valid_job):
    """Both jobs use the same claim, in which each job has its own folder."""
    job = valid_job(storage={"existingClaim": "runs", "resumeFrom": "5a0c"}, replicas=2)

    planned = plan(job, LAYOUT)

    told = [yaml.safe_load(each.config_map["data"]["training.yaml"]) for each in planned.replicas.values()]
    assert [each["resumeFrom"] for each in told] == [f"/var/lib/palaestra/5a0c/{index}" for index in (0, 1)]


def test_going_on_from_another_jobs_run_is_refused_without_a_cluster(valid_job):
    """A local run has no claim. Without an error, a person would learn late that training began at step 0."""
    job = valid_job(storage={"existingClaim": "runs", "resumeFrom": "5a0c"})
    layout = LocalLayout(images=LAYOUT.images, job_directory="/runs/job")

    with pytest.raises(PlanError, match=r"^spec\.storage\.resumeFrom: names a run on a claim .*; remove it"):
        plan(job, layout)


INITIAL = {"initialPolicy": {"claim": "policies", "path": "5a0c/0/model.zip"}}


def trainer_of(planned):
    """Return the trainer's configuration and its mounts."""
    replica = planned.replicas[0]
    training = yaml.safe_load(replica.config_map["data"]["training.yaml"])
    (container,) = pod(planned)["containers"]
    return training, container["volumeMounts"]


def test_the_claim_of_an_initial_policy_is_mounted_for_the_trainer_alone_to_read(in_cluster):
    """The claim belongs to another job, which may be running, so the trainer mounts it read-only."""
    planned = in_cluster(trainer=INITIAL)

    training, mounts = trainer_of(planned)

    volume = {"name": "initial-policy", "persistentVolumeClaim": {"claimName": "policies"}}
    mount = {"name": "initial-policy", "mountPath": "/initial-policy", "readOnly": True}
    mounted = [each["volumeMounts"] for each in pod(planned)["initContainers"]]
    assert training["initialPolicy"] == "/initial-policy/5a0c/0/model.zip"
    assert volume in pod(planned)["volumes"]
    assert mount in mounts
    assert not any(mount in others for others in mounted)


def test_an_initial_policy_on_the_run_s_own_claim_needs_no_second_volume(in_cluster):
    """Some storage drivers cannot mount one claim twice in a pod."""
    planned = in_cluster(trainer=INITIAL, storage={"existingClaim": "policies"})

    training, mounts = trainer_of(planned)

    assert training["initialPolicy"] == "/var/lib/palaestra/5a0c/0/model.zip"
    assert "initial-policy" not in [each["name"] for each in (*mounts, *pod(planned)["volumes"])]


def test_an_initial_policy_in_the_image_needs_no_volume(in_cluster):
    """The path is in the trainer's own file system."""
    training, mounts = trainer_of(in_cluster(trainer={"initialPolicy": {"path": "/opt/model.zip"}}))

    assert training["initialPolicy"] == "/opt/model.zip"
    assert "initial-policy" not in [each["name"] for each in mounts]


def test_an_initial_policy_on_a_claim_is_refused_without_a_cluster(valid_job):
    """A person would learn late that the run began with random weights."""
    layout = LocalLayout(images=LAYOUT.images, job_directory="/runs/job")

    with pytest.raises(PlanError, match=r"^spec\.trainer\.initialPolicy\.claim: names a claim .*; remove it"):
        plan(valid_job(trainer=INITIAL), layout)


def test_the_pod_is_restricted(in_cluster):
    """The Pod Security standard *restricted* applies to sidecars, too."""
    spec = pod(in_cluster())

    assert spec["automountServiceAccountToken"] is False
    assert spec["securityContext"]["runAsNonRoot"]
    for container in (*spec["initContainers"], *spec["containers"]):
        security = container["securityContext"]
        assert security["readOnlyRootFilesystem"]
        assert not security["allowPrivilegeEscalation"]
        assert security["capabilities"] == {"drop": ["ALL"]}


def test_a_cluster_may_choose_the_user_of_a_pod(valid_job):
    """OpenShift rejects a user outside the range of the namespace.

    The rest of the pod must stay restricted.
    """
    security = pod(plan(valid_job(), ClusterLayout(images=LAYOUT.images, user=None)))["securityContext"]

    assert security == {
        "runAsNonRoot": True,
        "seccompProfile": {"type": "RuntimeDefault"},
        "fsGroupChangePolicy": "OnRootMismatch",
    }


def test_a_job_s_own_node_label_wins_over_the_installation_s(valid_job):
    """The installation's label is only a default, because a user's image may need another type of node."""
    layout = ClusterLayout(
        images=LAYOUT.images, node_selector={"kubernetes.io/arch": "amd64", "pool": "robots"}
    )
    job = valid_job(scheduling={"nodeSelector": {"kubernetes.io/arch": "arm64"}})

    spec = pod(plan(job, layout))

    assert spec["nodeSelector"] == {"kubernetes.io/arch": "arm64", "pool": "robots"}


def test_a_pod_has_a_user_namespace_if_the_installation_asks_for_it(valid_job, in_cluster):
    """A process that escapes from its container then has no permissions on the node."""
    layout = ClusterLayout(images=LAYOUT.images, host_users=False)

    assert pod(plan(valid_job(), layout))["hostUsers"] is False
    assert "hostUsers" not in pod(in_cluster())


def test_scheduling_reaches_the_pod(in_cluster):
    """A platform engineer decides by these values on which nodes a pod runs."""
    planned = in_cluster(
        scheduling={
            "nodeSelector": {"gpu": "yes"},
            "tolerations": [{"key": "gpu", "operator": "Exists"}],
            "runtimeClassName": "nvidia",
            "priorityClassName": "low",
            "podLabels": {"example.com/team": "robots"},
            "podAnnotations": {"note": "x"},
        },
        imagePullSecrets=[{"name": "pull"}],
    )
    spec = pod(planned)
    metadata = planned.replicas[0].job["spec"]["template"]["metadata"]

    assert spec["nodeSelector"] == {"gpu": "yes"}
    assert spec["tolerations"] == [{"key": "gpu", "operator": "Exists"}]
    assert spec["runtimeClassName"] == "nvidia"
    assert spec["imagePullSecrets"] == [{"name": "pull"}]
    assert metadata["labels"]["example.com/team"] == "robots"
    assert metadata["annotations"] == {"note": "x"}


def test_every_mount_has_a_volume_and_every_volume_a_mount(in_cluster):
    """The API server rejects a mount without a volume, and a volume without a mount is a mistake."""
    spec = pod(in_cluster())
    mounted = {
        mount["name"]
        for container in (*spec["initContainers"], *spec["containers"])
        for mount in container["volumeMounts"]
    }

    assert {volume["name"] for volume in spec["volumes"]} == mounted


def test_seeds_of_replicas_differ(in_cluster):
    """Replicas run the same training with different random numbers."""
    seeds = [
        yaml.safe_load(each.config_map["data"]["training.yaml"])["seed"]
        for each in in_cluster(seed=7, replicas=3).replicas.values()
    ]

    assert seeds == [7, 8, 9]


LONG = "quadruped-blind-locomotion-rough-terrain-ppo-a"


def claims_of(planned):
    """Return the names of the claims in a plan, after a check that its Jobs mount them."""
    names = [each.claim["metadata"]["name"] for each in planned.replicas.values()]
    for name, each in zip(names, planned.replicas.values(), strict=True):
        volumes = each.job["spec"]["template"]["spec"]["volumes"]
        assert {"claimName": name} in [volume.get("persistentVolumeClaim") for volume in volumes]
    return names


def test_no_name_of_a_claim_is_longer_than_a_label(valid_job):
    """Storage provisioners copy the name of a claim into labels and tags, which allow 63 characters.

    With 46 characters for the job's name, the name of the claim had 85.
    """
    names = claims_of(plan(valid_job(LONG, replicas=12), LAYOUT))
    others = claims_of(plan(valid_job(LONG, uid="1" * 36, replicas=12), LAYOUT))

    assert max(map(len, names)) <= 63
    assert len({*names, *others}) == 24
    assert names[0].startswith("quadruped-blind-locomotion-rough-terrain-ppo")


def test_a_short_name_of_a_claim_has_the_whole_uid(valid_job):
    """Claims of existing jobs have such names, which must not change."""
    job = valid_job("walk")

    assert claims_of(plan(job, LAYOUT)) == [f"walk-0-{job.metadata.uid}"]
