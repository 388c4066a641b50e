"""A trained policy as one file, for programs without Palaestra, Stable-Baselines3 or PyTorch.

The file takes observations as the environment returns them, and returns actions that the environment accepts.
It is compared with the policy before it is written. It is not written if it acts differently.
"""

from palaestra_trainer.exporting.exporter import FORMATS, Exported, export

__all__ = ["FORMATS", "Exported", "export"]
