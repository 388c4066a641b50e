"""TrainingJobs from the hyperparameter files of RL-Baselines3-Zoo.

Pure: text in, text out. Whatever a TrainingJob cannot hold exactly becomes a note, never silence.

- `conversion`: one entry of a file as a TrainingJob with its notes
- `draft`: the job and the notes that the words of an entry fill
- `expressions`: Python expressions in a file, read as data and never evaluated
- `hyperparameter_file`: a file, its entries and its algorithm
- `mapping`: the place of each word in a TrainingJob
"""

from palaestra.zoo.conversion import Converted, convert
from palaestra.zoo.hyperparameter_file import ZooError

__all__ = ["Converted", "ZooError", "convert"]
