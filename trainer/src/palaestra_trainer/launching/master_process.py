"""A ROS master that ends with the program that started it; `python -m` this module.

It takes a free port of loopback and prints its URI. It ends when its standard input closes; the kernel closes
it even when the owner is killed.
"""

from __future__ import annotations

from palaestra_trainer.ros_master.cli import main

if __name__ == "__main__":
    main(["--until-stdin-closes"])
