"""A policy package on a real robot: check it, ask the person, drive episodes, and record everything.

- `checked_package`: reads a package, and refuses one that cannot drive the robot
- `onnx_policy`: the policy, run by onnxruntime
- `terminal`: the person's terminal; `hold_key`: motion only while a person holds a key
- `floor`: the places that a person types, and the fence around start and targets
- `record`: the record of a deployment as a bag, written by a thread of its own
- `read_record`: a record as the data of a report
- `goals`: goals that arrive while the program runs, one episode for each
- `deploy`: the dry run, the question, and the episodes

This package needs neither PyTorch nor Stable-Baselines3 nor ROS.
"""
