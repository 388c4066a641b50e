"""`python -m palaestra_trainer.ros_master`: as `palaestra-ros-master`."""

from palaestra_trainer.ros_master.cli import main

if __name__ == "__main__":
    main()
