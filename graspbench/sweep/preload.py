"""What the process that forks the workers loads, once, for all of them."""

from importlib import import_module

from graspbench.loading import keep_what_is_loaded, load_quickly

load_quickly()
import_module("graspbench.sweep.worker")
import_module("graspbench.trial.pipeline")
keep_what_is_loaded()
