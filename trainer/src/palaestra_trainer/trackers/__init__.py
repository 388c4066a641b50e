"""Callbacks that send the curves of a run to an experiment tracker.

Each tracker is a module of its own, because each needs a library that the trainer's image does not have.
"""
