"""TrainingJobs from the hyperparameter files of RL-Baselines3-Zoo.

The conversion is pure: it converts text to text. Each setting that a TrainingJob cannot represent exactly
becomes a note.

- `conversion`: one entry of a file as a TrainingJob with its notes
- `draft`: the job and the notes during the conversion of an entry
- `expressions`: reads the Python expressions in a file as data, and never evaluates them
- `hyperparameter_file`: the entries and the algorithm of a file
- `mapping`: the field of a TrainingJob for each key of an entry
"""

from palaestra.zoo.conversion import Converted, convert
from palaestra.zoo.hyperparameter_file import ZooError

__all__ = ["Converted", "ZooError", "convert"]
