"""The kinds of objects that the operator reads or writes, and their paths at the API server."""

from dataclasses import dataclass, replace
from urllib.parse import quote

from palaestra.objects import Object


@dataclass(frozen=True, slots=True, kw_only=True)
class Resource:
    """One kind of object.

    Attributes:
        api_version: group and version, such as `batch/v1`; `v1` for the core group.
        kind: the name of the kind in objects, such as `Job`.
        plural: the plural name of the kind in paths and RBAC rules, such as `jobs`.
        namespaced: whether objects are in namespaces; False for cluster-scoped kinds.
        metadata_only: whether to read only the metadata of objects, for example so that the content of
            Secrets is not transferred.
        page: number of objects that a cache requests in one page of a list.
    """

    api_version: str
    kind: str
    plural: str
    namespaced: bool = True
    metadata_only: bool = False
    # With items of about 25 kB each, pages of 200 items fragmented 70 MiB of memory, and pages of 25 only 5
    # MiB.
    page: int = 25

    def address(self, namespace: str | None = None, name: str | None = None) -> str:
        """Return the path of one object, or of the collection.

        Args:
            namespace: the namespace; None for all namespaces, and for cluster-scoped kinds.
            name: the name of the object; None for the collection.
        """
        root = "/api/" if "/" not in self.api_version else "/apis/"
        parts = [root + self.api_version]
        if namespace is not None and self.namespaced:
            parts += ["namespaces", quote(namespace, safe="")]
        parts.append(self.plural)
        if name is not None:
            parts.append(quote(name, safe=""))
        return "/".join(parts)

    def only_metadata(self) -> "Resource":
        """Return the same kind with `metadata_only`, so that only the metadata of objects is read."""
        return replace(self, metadata_only=True)


TRAINING_JOBS = Resource(
    api_version="palaestra.dev/v1alpha1",
    kind="TrainingJob",
    plural="trainingjobs",
    page=10,  # items of up to 1.5 MB each, the limit of an API server
)
JOBS = Resource(api_version="batch/v1", kind="Job", plural="jobs")
PODS = Resource(api_version="v1", kind="Pod", plural="pods")
CONFIG_MAPS = Resource(api_version="v1", kind="ConfigMap", plural="configmaps")
CLAIMS = Resource(api_version="v1", kind="PersistentVolumeClaim", plural="persistentvolumeclaims")
SECRETS = Resource(api_version="v1", kind="Secret", plural="secrets")
EVENTS = Resource(
    api_version="v1", kind="Event", plural="events"
)  # events of the core group, which `kubectl describe` shows
NETWORK_POLICIES = Resource(
    api_version="networking.k8s.io/v1", kind="NetworkPolicy", plural="networkpolicies"
)
# Kueue serves this version since 0.15. Kueue also stores this version since 0.16, so that no webhook must
# convert objects.
WORKLOADS = Resource(api_version="kueue.x-k8s.io/v1beta2", kind="Workload", plural="workloads")
LEASES = Resource(api_version="coordination.k8s.io/v1", kind="Lease", plural="leases")
NODES = Resource(api_version="v1", kind="Node", plural="nodes", namespaced=False)
NAMESPACES = Resource(api_version="v1", kind="Namespace", plural="namespaces", namespaced=False)
DEFINITIONS = Resource(
    api_version="apiextensions.k8s.io/v1",
    kind="CustomResourceDefinition",
    plural="customresourcedefinitions",
    namespaced=False,
)
# Only the command line reads the next two kinds.
DEPLOYMENTS = Resource(api_version="apps/v1", kind="Deployment", plural="deployments")
STORAGE_CLASSES = Resource(
    api_version="storage.k8s.io/v1", kind="StorageClass", plural="storageclasses", namespaced=False
)
# Objects of these kinds are access reviews: the response to the creation of a review states whether an
# account has a permission.
OWN_RIGHTS = Resource(
    api_version="authorization.k8s.io/v1",
    kind="SelfSubjectAccessReview",
    plural="selfsubjectaccessreviews",
    namespaced=False,
)
RIGHTS = Resource(
    api_version="authorization.k8s.io/v1",
    kind="SubjectAccessReview",
    plural="subjectaccessreviews",
    namespaced=False,
)

ALL: tuple[Resource, ...] = (
    TRAINING_JOBS,
    JOBS,
    PODS,
    CONFIG_MAPS,
    CLAIMS,
    SECRETS,
    EVENTS,
    NETWORK_POLICIES,
    LEASES,
    NODES,
    NAMESPACES,
    DEFINITIONS,
)
_BY_KIND = {(resource.api_version, resource.kind): resource for resource in ALL}


def resource_of(obj: Object) -> Resource:
    """Return the resource of an object, by its apiVersion and kind.

    Raises:
        KeyError: the operator does not use this kind.
    """
    key = (obj.get("apiVersion", ""), obj.get("kind", ""))
    if key not in _BY_KIND:
        raise KeyError(f"apiVersion, kind: {key[0]} {key[1]} is not one of palaestra.cluster.resources")
    return _BY_KIND[key]
