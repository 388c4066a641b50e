"""Start the simulators of a run through their sidecars, and restart them after faults.

`ros2_gateway` publishes a robot of a running simulator as topics of ROS 2.
"""
