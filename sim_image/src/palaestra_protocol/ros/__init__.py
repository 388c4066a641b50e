"""ROS 1 for trainer and simulator; all modules except `sockets` are pure.

- `tcpros`: connection headers and frames, as bytes
- `definitions`: the types of the interface, as text
- `rostypes`: their md5 sums, and values to and from bytes
- `sockets`: the socket options of both ends
"""
