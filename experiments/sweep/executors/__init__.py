"""Executors of the runs of a sweep: this process, other processes, other machines."""

from experiments.sweep.executors.executor import Executor, WorkerSettings

__all__ = ["Executor", "WorkerSettings"]
