"""Callbacks that send the curves of a run to an experiment tracker.

Each tracker has its own module, because it needs a library that the trainer's image does not have.
"""
