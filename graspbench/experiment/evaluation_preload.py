"""What the process that forks the workers of an evaluation loads, once, for all of them."""

from importlib import import_module

from graspbench.loading import keep_what_is_loaded, load_quickly

load_quickly()
import_module("graspbench.experiment.evaluation_work")
keep_what_is_loaded()
