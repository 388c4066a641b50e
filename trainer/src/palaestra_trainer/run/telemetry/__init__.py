"""Report the progress of a run while it trains, in /status, /metrics, files and the log."""
