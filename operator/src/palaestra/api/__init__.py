"""The TrainingJob: its models, its validation, and the files that are generated from the models.

The models are the only source: the CustomResourceDefinition, its rules and the reference page are generated
from them. No module here uses a cluster or a clock, and only `generated_files` reads files.
"""

from palaestra.api.job import API_VERSION, KIND, Metadata, Spec, TrainingJob
from palaestra.api.loading import as_data, broken_guards, dump, load, validate
from palaestra.api.scheduling import Scheduling
from palaestra.api.simulators import Driver, SimulatorGroup, WorldSource
from palaestra.api.status import Status
from palaestra.api.storage import Storage
from palaestra.api.trainer import Reward, Trainer
from palaestra_protocol.pod.enums import Role

__all__ = [
    "API_VERSION",
    "KIND",
    "Driver",
    "Metadata",
    "Reward",
    "Role",
    "Scheduling",
    "SimulatorGroup",
    "Spec",
    "Status",
    "Storage",
    "Trainer",
    "TrainingJob",
    "WorldSource",
    "as_data",
    "broken_guards",
    "dump",
    "load",
    "validate",
]
