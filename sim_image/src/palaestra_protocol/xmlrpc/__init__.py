"""XML-RPC as ROS 1 uses it, between peers that are not trusted.

- `documents`: requests and responses, as bytes; pure
- `responses`: the response of every ROS call; pure
- `server`: one port that serves calls
- `client`: one call, with a deadline
"""
