"""Export a trained policy as one file, for programs without Palaestra, Stable-Baselines3 or PyTorch.

The file takes observations as the environment returns them, and returns actions that the environment accepts.
Before the file is written, its actions are compared with the actions of the policy. If the actions differ,
the file is not written.
"""

from palaestra_trainer.exporting.exporter import FORMATS, Exported, export

__all__ = ["FORMATS", "Exported", "export"]
