"""A real Robotino behind the interface of robots, so that an environment can drive it without changes.

- `frames`: poses of odometry in the frame of the task
- `safety`: the rules that decide, for each command, whether the robot may move
- `readings`: the newest readings of a robot, with their times
- `link`: the interface of a connection to a robot; `rest`: the connection over REST
- `rest_answers`: the responses of the REST interface as readings; `sensor_layout`: how distances are reported
- `ros1`: the connection over ROS 1; `ros1_messages`: the messages of the robot's driver as readings
- `ros2`: the connection over ROS 2; `ros2_messages`: its scan of distances as a reading
- `ros2_clock`: the time of a simulation that publishes /clock
- `connect`: the connection for an address; `topics`: topics with other names than those of the driver
- `camera`: pictures of the camera as images of the size that a policy learned with
- `command_loop`: sends the command of a policy at 20 Hz, as far as the safety rules allow
- `ros_images`: pictures in messages of both ROS
- `robotino`: the robot; `scene`: its floor, on which a person places it
- `robot_clock`: the time of a robot, which may run faster than real time in a mock robot
- `deployment`: a policy package that drives the robot; no other module depends on a task or a policy
"""
