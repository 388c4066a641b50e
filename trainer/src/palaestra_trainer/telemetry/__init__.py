"""Reports of a run while it trains: progress, metrics, /status, /metrics, the log and the display."""
