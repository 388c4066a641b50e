"""Messages, metrics, HTTP server and small rules that operator, trainer, sidecar and simulator share.

- `control`: between trainer and sidecar: the requests, and the state of a simulator
- `pod`: between trainer and operator: `/status`, the termination message, exit codes
- `ros`: between trainer and simulator: connections, types and values of ROS 1
- `scene`: what a world looks like, and where its parts are, for viewers and replays
- `camera_picture`: the newest picture of a robot's camera, for viewers
- `foreign_words`: words of other projects, and their places in a TrainingJob
- `messages`: messages whose readers and writers follow from their declarations
- `fields`: checks of received JSON, because its sender is not trusted
- `metrics`: families of metrics, as data
- `numbers`: numbers of command-line options
- `linux`: refusing a system other than Linux
- `imports`: faster imports for programs
- `masking`: text in which the passwords of addresses are masked
- `shadowing`: a user's modules that shadow those of Python and of dependencies
- `signals`: the signals that a program handles
- `http`: the HTTP server of operator, trainer and sidecar, with limits for time and size
- `xmlrpc`: XML-RPC as ROS uses it, with limits for time and size
- `tcp_server`: the base of both servers: one port, with a thread for each connection
- `connection_limits`: the connections that these servers keep

This package imports none of the others. All modules except `connection_limits`, `http`, `imports`,
`linux`, `shadowing`, `signals`, `tcp_server`, `ros.sockets` and the server and client of `xmlrpc` are pure:
values and bytes.
"""
