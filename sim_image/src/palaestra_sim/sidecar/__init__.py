"""The sidecar: one process that starts, watches and stops a simulator on request of a trainer.

A sidecar may have a second simulator as a standby. The two simulators share only the sidecar's process and
ports.

- `entry`: the start of the program: blocks signals before other imports; `blocked_signals`: lists the signals
- `cli`: checks options and world, then runs the simulators; `options`: the command-line options
- `world_files`: writes the world that the simulator will run, with its own ROS names
- `project`: makes a Webots project around that world, with links to the files around the source world
- `drivers`: the command lines of stub, MuJoCo, Webots and other programs
- `lifecycle`: the table of states, events and actions; pure
- `simulator`: owns a simulator's state, handles events in order and runs the table's actions
- `process`: the only module that starts a process
- `reaper`: a small program between sidecar and simulator; it ends all descendants of the simulator
- `signals`: the thread that waits for signals
- `output`: forwards the simulator's output line by line
- `left_out`: reads the simulator's report on the nodes that it leaves out of its world
- `viewing`: reads the simulator's data for viewers, at most 30 times a second
- `last_request`: remembers when the last request came to the control port
- `server`: the routes of the control port and of the health port
- `metric_definitions`: declares every metric
- `metrics`: the values in /metrics
"""
