"""Wait for simulators with a deadline, take turns in one thread, and handle signals."""
