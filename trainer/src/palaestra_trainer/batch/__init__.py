"""The connection to a simulator that steps many copies of its world; see `palaestra_protocol.batch`."""

from palaestra_trainer.batch.link import BatchLink, BatchReading, BatchReset

__all__ = ["BatchLink", "BatchReading", "BatchReset"]
