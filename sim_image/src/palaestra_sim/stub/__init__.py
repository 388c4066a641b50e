"""The stub simulator: a physics without masses and forces; it is small, fast, and exact within these limits.

- `entry`: the start of `palaestra-stub`, which refuses a system other than Linux; `cli`: the program
- `physics`: the robots and obstacles of a world
- `body`, `contacts`: motion, and what a robot runs into
- `rays`, `others`: how far the beams of sensors travel, and robots as they meet them
- `outline`, `obstacles`: shapes, seen from above

`scene` has worlds and devices, `ros_controller` the interface of Webots' `ros` controller; all simulators
share them.
"""
