"""`python -m palaestra_trainer.ros_master` runs the program `palaestra-ros-master`."""

from palaestra_trainer.ros_master.cli import main

if __name__ == "__main__":
    main()
