"""What the process that forks the workers loads, once, for all of them."""

from importlib import import_module

from graspbench.garbage import collect_rarely, keep_what_is_loaded

collect_rarely()
import_module("graspbench.sweep.worker")
import_module("graspbench.trial.pipeline")
keep_what_is_loaded()
