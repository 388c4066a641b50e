"""Why a TrainingJob has no plan, though each of its fields is right by itself."""

from palaestra.errors import TrainingJobError


class PlanError(TrainingJobError, ValueError):
    """The job cannot be planned in this layout; the message is `<field>: <fact>; <remedy>`."""
