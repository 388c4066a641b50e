"""Start and stop the processes around a simulator: its sidecar, the simulator itself, and a ROS master."""
