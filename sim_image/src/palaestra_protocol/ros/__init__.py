"""ROS 1 as trainer and simulator speak it.

tcpros       PURE: connection headers and frames, as bytes
definitions  PURE: the types of the interface, as text
rostypes     PURE: their md5 sums, and values to and from bytes
sockets      how both ends set up their sockets
"""
