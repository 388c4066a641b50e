"""The reports of a trainer that the operator reads.

- `status`: `/status` while the trainer runs, and the termination message after it has ended
- `enums`: exit codes, kinds of faults, uses of time, roles
"""
