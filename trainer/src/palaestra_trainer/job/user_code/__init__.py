"""The code of a job's author: its classes and their options are checked."""
