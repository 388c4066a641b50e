"""The stub simulator: worlds, robots and the ROS interface of Webots' `ros` controller, without Webots.

- `cli`: `palaestra-stub`
- `front`: the `ros` controllers of the robots, with their services and topics
- `ros`: the wire
- `scene`: the contents of a world, its devices, nodes and fields, and the steps of time
- `physics`: motion, contacts and rays
- `faults`: faults on demand
- `seam`: the Protocol of a node, and services as data
"""
