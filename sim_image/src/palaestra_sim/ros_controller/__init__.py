"""The `ros` controllers of the robots: names, services, topics and messages, over a node of `ros`."""
