"""The sidecar: one process that starts, watches and stops a simulator, for a trainer to command.

It may have a second simulator that stands by. The two share the process and its ports, and nothing else.

cli          the command line: check everything, then run
preparation  the world that the simulator will run, with its own ROS names
drivers      the command lines of stub, Webots and other programs
lifecycle    PURE: what may happen in which state, as a table
simulator    the one owner of the state: takes events in order, does what the table says
process      the only module that starts a process
keeper       the small program between sidecar and simulator, which lets nothing escape
output       what the simulator prints, passed on line by line
server       the two listeners: control, and health with metrics and state
families     every metric by name, as data
metrics      what /metrics says
"""
