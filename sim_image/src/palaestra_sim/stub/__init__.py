"""The stub simulator: a physics without masses and forces; it is small, fast, and exact within these limits.

- `cli`: `palaestra-stub`
- `physics`: the robots and obstacles of a world
- `body`, `contacts`: the motion of robots, and their contacts
- `rays`: the distances that the beams of sensors travel
- `outline`, `obstacles`: shapes, seen from above

`scene` has worlds and devices, `ros_controller` the interface of Webots' `ros` controller; all simulators
share them.
"""
