"""Import the classes of a job's author, check their options, and copy the values that they exchange."""
