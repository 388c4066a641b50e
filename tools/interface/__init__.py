"""The page docs/ros-interface.md: every service and topic of a robot, and which simulators have it."""
