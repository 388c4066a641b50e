"""The programs of this package, a module each; `program` has what they share."""
