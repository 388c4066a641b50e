"""The sidecar: one process that starts, watches and stops a simulator on request of a trainer.

It may have a second simulator as a standby. The two share the process and its ports, and nothing else.

- `entry`: the start: blocks signals before it imports anything else; `blocked_signals`: the list of these
- `cli`: the command line: check everything, then run; `options`: its options
- `world_files`: the world that the simulator will run, with its own ROS names
- `project`: the Webots project around that world: a folder, and links to the files around the source
- `drivers`: the command lines of stub, MuJoCo, Webots and other programs
- `lifecycle`: the events that each state allows, as a table; pure
- `simulator`: the one owner of the state, which receives events in order and runs the table's actions
- `process`: the only module that starts a process
- `reaper`: the small program between sidecar and simulator, from which no process can escape
- `signals`: the thread that only waits for signals
- `output`: the simulator's output, forwarded line by line
- `left_out`: the simulator's report on the nodes that it leaves out of its world
- `viewing`: what the simulator shows to viewers, read at most 30 times a second
- `server`: the routes of the two ports: control, and health with metrics and state
- `metric_definitions`: every metric by name, as data
- `metrics`: the content of /metrics
"""
