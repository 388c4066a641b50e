"""The sidecar: one process that starts, watches and stops a simulator at a trainer's command.

It may have a second simulator as a standby. The two share the process and its ports, and nothing else.

- `entry`: the start: signals are held back before anything else is imported; `blocked_signals`: which ones
- `cli`: the command line: check everything, then run; `options`: its options
- `world_files`: the world that the simulator will run, with its own ROS names
- `project`: the Webots project around that world: a folder, and links to what is around the source
- `drivers`: the command lines of stub, Webots and other programs
- `lifecycle`: the events that each state allows, as a table; pure
- `simulator`: the one owner of the state, which takes events in order and carries out the table's actions
- `process`: the only module that starts a process
- `reaper`: the small program between sidecar and simulator, from which no process can escape
- `signals`: received by one thread that waits for nothing else
- `output`: the simulator's output, forwarded line by line
- `left_out`: the simulator's report on what it leaves out of its world
- `server`: the routes of the two ports: control, and health with metrics and state
- `metric_definitions`: every metric by name, as data
- `metrics`: the content of /metrics
"""
