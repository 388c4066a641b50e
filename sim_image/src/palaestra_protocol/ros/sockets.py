"""How both ends of a ROS connection set up their sockets."""

import socket

# For `socket.setsockopt`. Small messages go at once; and without BBR, which many machines use by default: its
# model of the path, and a timer for each connection, cost more than what they could bring to a few bytes.
OPTIONS = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
    (socket.IPPROTO_TCP, socket.TCP_CONGESTION, b"reno"),
)

# To be read at first: what a step needs is shorter, and Python has blocks of up to 512 bytes at hand, which
# all connections use in turn. What is longer comes with the next read.
FIRST_BYTES = 448
