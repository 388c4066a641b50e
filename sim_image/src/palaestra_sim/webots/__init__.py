"""A controller for robots in Webots, which offers the interface of Webots' own `ros` controller.

Webots starts one process of this controller for each robot. The controller uses libController, the C library
of Webots, and needs neither ROS nor the controller of Webots. So it works with every release of Webots since
R2023b, also with releases that have no `ros` controller. `palaestra_sim.webots_project` writes the files that
let Webots find the controller.

- `library`: libController and the functions in `prototypes.txt`, with Python values as arguments and results
- `options`: the controllerArgs of a robot
- `steps`: the steps, in a thread of their own
- `devices`: the devices of a robot
- `services`: the services of a robot and of a supervisor
- `robot`: the robot as `ros_controller` serves it
- `process`, `cli`: the controller as a process
"""
