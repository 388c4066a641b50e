"""A Webots for tests: a program that starts controllers as Webots does, and a libController for them.

The program simulates the world with this project's stub, so that a robot moves and its sensors measure. Its
answers come from the stub's services, by the names of the C functions; only tests/fake_webots knows these
rules. A wrong name or a wrong order of arguments in the controller gives a wrong value.

- `libcontroller.c`, `functions.h`: the library
- `home`: WEBOTS_HOME of a release, with the compiled library
- `wire`: requests and results as bytes
- `answers`: the result of each function
- `program`: the command `webots`: its command line, the controllers' processes, and the steps
"""
