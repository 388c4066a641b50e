"""ROS 2 by rclpy, which a person's installation of ROS 2 brings; this project does not install it.

- `node`: a node of ROS 2 with a context and a thread of its own
"""
