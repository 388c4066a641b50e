"""The mock robot: it has the network interface and the habits of a Robotino, in a scene of the stub.

With this mock, people test the program that deploys a policy before they use a real robot. The *habits* of
the robot are its delays, limits and errors.

- `entry`: checks that the system is Linux, then starts `cli`; `cli`: the program `palaestra-mock-robot`
- `base`: the firmware of the base: the dead man's switch and the limits of the acceleration
- `odometry`: the pose that the robot computes from its wheels, with drift
- `infrared`: the distance that a sensor reports, from its voltage
- `camera`: the test picture of its camera
- `robot`: one robot: its scene, its base, its odometry and its sensors
- `pace`: the robot's clock, and the thread that advances the robot
- `driver`: the habits of the robot's driver for ROS 1; `ros1`: the node of this driver
- `rest`: the routes of a Robotino and of the mock, with the delays of a network
- `server`: an HTTP server whose connections stay open

All durations are in *robot time*, which is real time times `--speed`. Sources of the robot's habits: the page
Rest_api of wiki.openrobotino.org, and the driver robotino-ros-pkg. The habits were not measured on a robot.
"""
