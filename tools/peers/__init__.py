"""docs/explain/peers.md: the measured comparisons, which are made from docs/explain/peers.json."""
