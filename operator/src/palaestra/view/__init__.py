"""TrainingJobs for people's eyes. Pure: from what is known to text; the clock is passed in.

`tables` and `sparkline` draw, `durations` says how long, `describe` tells all of one job, `history` keeps
what a job's figures were, and `live` shows it as it moves.
"""

from palaestra.view.describe import describe, happened, progress
from palaestra.view.durations import short
from palaestra.view.history import History
from palaestra.view.live import live
from palaestra.view.sparkline import sparkline
from palaestra.view.tables import lines_of, server_table

__all__ = [
    "History",
    "describe",
    "happened",
    "lines_of",
    "live",
    "progress",
    "server_table",
    "short",
    "sparkline",
]
