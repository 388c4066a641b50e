"""What trainer, sidecar, simulator and operator say to each other. Pure: values and bytes, no socket.

control      between trainer and sidecar: the requests, and the state of a simulator
status       what a trainer tells the operator: `/status`, the termination message
terms        the words of both: exit codes, kinds of faults, causes of time, roles
metrics      what a family of metrics is, as data
fields       checks of that JSON when it is read, since its sender is not trusted
tcpros       the wire of ROS 1
definitions  the ROS types of the interface, as text
rostypes     their md5 sums, and values to and from bytes
"""
