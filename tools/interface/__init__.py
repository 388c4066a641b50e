"""docs/reference/ros-interface.md: each service and topic of a robot, and the simulators that have it."""
