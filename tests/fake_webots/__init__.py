"""A Webots for tests: a program that starts controllers as Webots does, and a libController for them.

The program simulates the world with this project's stub, so that a robot moves and its sensors measure. For
the call of a C function, the program derives the name of a stub's service from the function's name, and
returns this service's result. The controller has no code for this mapping. So if it calls a wrong function,
or passes arguments in a wrong order, it gets a wrong value.

- `libcontroller.c`, `functions.h`: the library
- `home`: WEBOTS_HOME of a release, with the compiled library
- `wire`: requests and results as bytes
- `answers`: the result of each function
- `program`: the command `webots`: its command line, the controllers' processes, and the steps
"""
