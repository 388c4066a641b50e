"""The report of runs, as one HTML file: what was asked, what happened, and how to repeat it."""
