"""The conformance of a simulator: the claims of the page "The ROS interface", checked one by one.

`interface.json` has the claims; `make golden` writes this file from tools/interface. `claims` reads it and
evaluates responses, `player` makes the calls with any client, `wire_client` is the client, and `report`
writes the results. `rehearsal` checks time, steps and resets for the claims of a training.
"""
