"""What a trainer reports about its pod, and an operator reads.

status  `/status` while the trainer runs, and the termination message at its end
terms   the words of both: exit codes, kinds of faults, causes of time, roles
"""
