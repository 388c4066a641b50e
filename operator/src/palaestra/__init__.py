"""The control plane: the TrainingJob, its plan, and the local runner."""
