"""What operator, trainer, sidecar and simulator have in common: their messages, metrics, numbers and server.

control   between trainer and sidecar: the requests, and the state of a simulator
pod       between trainer and operator: `/status`, the termination message, exit codes
ros       between trainer and simulator: connections, types and values of ROS 1
fields    checks of JSON when it is read, since its sender is not trusted
metrics   what a family of metrics is, as data
numbers   numbers of command-line options
http      the server of operator, trainer and sidecar, with a bound for everything

The package imports none of the others. All is pure, values and bytes, but `http` and `ros.sockets`.
"""
