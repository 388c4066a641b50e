"""The services of a robot in Webots, with one module for each group of services."""
