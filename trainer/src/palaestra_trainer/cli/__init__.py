"""The command-line programs of this package; the module `program` has their common functions."""
