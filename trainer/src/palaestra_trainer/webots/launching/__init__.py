"""Start and stop the processes of a simulator: its sidecar, the simulator itself, and a ROS master."""
