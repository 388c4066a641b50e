"""The reports of a trainer that the operator reads.

- `status`: `/status` while the trainer runs, and the termination message at its end
- `enums`: the enumerations of both: exit codes, kinds of faults, causes of time, roles
"""
