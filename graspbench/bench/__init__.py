"""Benchmarks: this package against its peers, each pair measured in the same run."""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from inspect import signature
from pathlib import Path

from graspbench.bench.result import BenchResult
from graspbench.errors import ConfigurationError

__all__ = ["BENCHMARKS", "BenchResult", "run_benchmarks"]

BENCHMARKS = {
    "clik": "graspbench.bench.clik_step",
    "global": "graspbench.bench.global_search",
    "planner": "graspbench.bench.planner",
    "quality": "graspbench.bench.quality",
    "reconstruction": "graspbench.bench.reconstruction",
}


def run_benchmarks(
    names: Sequence[str], output_dir: Path, say: Callable[[str], object], **options: object
) -> Iterator[BenchResult]:
    """Run benchmarks one after the other.

    Args:
        names: Any of `BENCHMARKS`.
        output_dir: Where plots go.
        say: Called with the name of each benchmark as it starts.
        options: Arguments of the benchmarks; None leaves the default. Each benchmark takes those it knows.

    Raises:
        ConfigurationError: There is no benchmark of such a name, or an option means nothing to any of
            them; nothing is run then.
    """
    for name in names:
        if name not in BENCHMARKS:
            raise ConfigurationError(
                f"unknown benchmark '{name}'", remedy=f"choose from {', '.join(BENCHMARKS)}", name=name
            )
    wanted = {key: value for key, value in options.items() if value is not None}
    runs = {name: import_module(BENCHMARKS[name]).run for name in names}
    for key in wanted:
        if not any(key in signature(run).parameters for run in runs.values()):
            raise ConfigurationError(
                f"--{key} means nothing to the benchmark {', '.join(names)}", remedy=f"leave --{key} out"
            )
    for name, run in runs.items():
        say(f"measuring {name}")
        known = signature(run).parameters
        yield run(output_dir=output_dir, **{key: value for key, value in wanted.items() if key in known})
