"""TrainingJobs from the hyperparameter files of RL-Baselines3-Zoo.

Pure: text in, text out. Each setting that a TrainingJob cannot represent exactly becomes a note.

- `conversion`: one entry of a file as a TrainingJob with its notes
- `draft`: the job and the notes, which the keys of an entry fill
- `expressions`: Python expressions in a file, read as data and never evaluated
- `hyperparameter_file`: a file, its entries and its algorithm
- `mapping`: the field of a TrainingJob for each key of an entry
"""

from palaestra.zoo.conversion import Converted, convert
from palaestra.zoo.hyperparameter_file import ZooError

__all__ = ["Converted", "ZooError", "convert"]
