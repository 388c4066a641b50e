"""The cache finds objects by name and label, returns copies, and holds the last version of each object."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from palaestra.cluster import Store
from palaestra.cluster.store import JOB_LABEL

namespaces, names = st.sampled_from(["n1", "n2"]), st.sampled_from("abcd")
labels = st.dictionaries(st.sampled_from([JOB_LABEL, "role"]), st.sampled_from("xy"))


def make_object(name="a", namespace="n1", **labels):
    """Return an object with labels; `job` stands for the label that has an index."""
    marks = {JOB_LABEL if key == "job" else key: value for key, value in labels.items()}
    return {"metadata": {"name": name, "namespace": namespace, "labels": marks}}


class Cache(RuleBasedStateMachine):
    """Insertions and removals in any order give the same results as in a dict."""

    def __init__(self):
        super().__init__()
        self.store = Store()
        self.model = {}

    @rule(namespace=namespaces, name=names, labels=labels)
    def put(self, namespace, name, labels):
        """Insert a new object, or a new version with other labels."""
        obj = {"metadata": {"name": name, "namespace": namespace, "labels": labels}}

        assert self.store.put(obj) == (self.model.get((namespace, name)) != obj)
        self.model[namespace, name] = obj

    @rule(namespace=namespaces, name=names)
    def drop(self, namespace, name):
        """Remove an object."""
        assert self.store.drop(namespace, name) == self.model.pop((namespace, name), None)

    @rule(namespace=st.none() | namespaces, wanted=labels)
    def select(self, namespace, wanted):
        """A selection by labels gives the same objects with and without the index."""
        found = self.store.select(namespace, wanted)

        assert found == [
            obj
            for (where, _), obj in sorted(self.model.items())
            if namespace in (None, where) and wanted.items() <= obj["metadata"]["labels"].items()
        ]

    @invariant()
    def holds_what_was_put(self):
        """The cache holds exactly the objects of the model."""
        assert self.store.keys() == self.model.keys()
        assert len(self.store) == len(self.model)
        assert all(self.store.get(*key) == obj for key, obj in self.model.items())


Cache.TestCase.settings = settings(max_examples=60, stateful_step_count=30)
TestCache = Cache.TestCase


def test_what_a_reader_changes_nobody_else_sees():
    """If readers shared an object, one reader's change would give wrong data to the next reader."""
    store = Store()
    store.put(make_object(job="x"))

    store.get("n1", "a")["metadata"]["labels"].clear()

    assert store.select("n1", {JOB_LABEL: "x"}) == [make_object(job="x")]


def test_objects_outside_of_namespaces_are_found_without_one():
    """Cluster-scoped objects such as nodes have no namespace."""
    store = Store()
    store.put({"metadata": {"name": "node"}})

    assert store.get(None, "node") == {"metadata": {"name": "node"}}


def test_nothing_remains_of_what_was_dropped():
    """An operator that has seen a million jobs must not use more memory than a new one."""
    store = Store()
    for number in range(1000):
        store.put(make_object(f"o{number}", f"n{number}", job=f"j{number}"))
        store.drop(f"n{number}", f"o{number}")

    assert len(store) == 0
    assert store.select(None, {}) == []


def test_an_object_whose_job_label_changes_is_returned_as_it_was_before():
    """Both jobs must be reconciled: the job that lost the object and the job that received it."""
    store = Store()
    store.put(make_object(job="x"))

    assert store.relabeled(make_object(job="x", role="y")) is None
    assert store.relabeled(make_object("b", job="y")) is None
    assert store.relabeled(make_object(job="y")) == make_object(job="x")
