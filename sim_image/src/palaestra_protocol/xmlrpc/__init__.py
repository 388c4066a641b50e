"""XML-RPC as ROS 1 uses it, between peers that are not trusted.

- `documents`: encodes and decodes requests and responses; pure
- `responses`: the value that every ROS call returns; pure
- `server`: a server on one port
- `client`: makes one call, with a deadline
"""
