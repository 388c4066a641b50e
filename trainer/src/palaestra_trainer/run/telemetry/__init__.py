"""Reports of a run while it trains: progress, metrics, /status, /metrics and the log."""
