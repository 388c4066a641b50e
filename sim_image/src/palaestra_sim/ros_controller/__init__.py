"""The `ros` controllers of robots: their services, topics and messages; the package `ros` has the nodes."""
