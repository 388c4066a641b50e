"""Export a trained policy as one file, for programs without Palaestra, Stable-Baselines3 or PyTorch.

The file takes observations as the environment returns them, and returns actions that the environment accepts.
Before the file is written, its actions are compared with the actions of the policy. If the actions differ,
the file is not written. The recorded episodes of a run are exported as one file too.
"""

from palaestra_trainer.exporting.exporter import (
    BAG,
    FORMATS,
    Exported,
    ExportedEpisodes,
    export,
    export_episodes,
)

__all__ = ["BAG", "FORMATS", "Exported", "ExportedEpisodes", "export", "export_episodes"]
