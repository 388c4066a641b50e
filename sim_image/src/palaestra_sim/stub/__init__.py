"""The stub simulator: small and fast, because its physics has no masses and no forces.

- `entry`: checks that the system is Linux, then starts `cli`; `cli`: the program `palaestra-stub`
- `physics`: moves the robots of a world, and computes their contacts and sensor rays
- `body`, `contacts`: the motion of a robot, and its contact points
- `rays`, `others`: the distances that sensor rays travel, and the robots that they hit
- `outline`, `obstacles`: shapes as seen from above

All simulators share `scene`, which has the worlds and devices, and `ros_controller`, which has the interface
of Webots' `ros` controller.
"""
