"""The stub simulator: worlds, robots and the ROS interface of Webots' `ros` controller, without Webots.

- `simulation`: time, steps and resets, without ROS
- `scene`, `devices`, `physics`, `rays`: the contents of a world, and their motion
- `tree`, `nodes`, `fields`: the scene tree as a supervisor sees it
- `controller`, `services`: the services and topics of one robot
- `ros`: the wire
"""
