"""Write the report of runs as one HTML file: the settings, the results, and commands to repeat them."""
