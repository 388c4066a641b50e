"""What a run reports while it trains: progress, figures, /status, /metrics, the log and the display."""
