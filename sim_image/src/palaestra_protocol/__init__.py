"""Messages, metrics, HTTP server and small rules that operator, trainer, sidecar and simulator share.

- `control`: the requests of a trainer to a sidecar, and the sidecar's reports about a simulator
- `pod`: the reports of a trainer to the operator: `/status`, the termination message, exit codes
- `ros`: ROS 1 between trainer and simulator: connections, types and values
- `scene`: the visible shapes of a world and their poses, for viewers and replays
- `batch`: the requests of a trainer to a simulator with many copies of its world
- `obstacle_shapes`: the shapes of obstacles on a floor, in the axes of their objects
- `camera_picture`: the newest picture of a robot's camera, for viewers
- `foreign_words`: options of other projects, and the TrainingJob fields that replace them
- `messages`: derives the reader and the writer of a JSON message from its declaration
- `policy_package`: the manifest of an exported policy with its files, and the check of these files
- `package_archive`: a policy package as one zip, read without unpacking it to a disk
- `fields`: checks received JSON, because its sender is not trusted
- `metrics`: declares metrics as data: names, help texts, labels and buckets
- `numbers`: parses the numbers of command-line options
- `linux`: ends a program that runs on a system other than Linux
- `imports`: makes the imports of a program faster
- `masking`: masks the passwords in the addresses of a text
- `shadowing`: finds a user's modules that shadow modules of Python or of a dependency
- `signals`: selects the signals that a program handles
- `temporary_folder`: makes a folder that exists as long as its process
- `whole_file`: writes files atomically
- `http`: the HTTP server of operator, trainer and sidecar, with limits for time and size
- `xmlrpc`: XML-RPC as ROS uses it, with limits for time and size
- `tcp_server`: the base class of the HTTP and XML-RPC servers: one port, a thread for each connection
- `connection_limits`: limits the number of connections of these servers

This package imports no other package of Palaestra. These modules use sockets, threads, processes or the
interpreter's state: `connection_limits`, `http`, `imports`, `linux`, `shadowing`, `signals`, `tcp_server`,
`temporary_folder`, `whole_file`, `ros.sockets`, and the server and client of `xmlrpc`. All other modules are
pure: they compute values from values.
"""
