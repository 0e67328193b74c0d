"""Benchmarks: this package against its peers, each pair measured in the same run."""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path

from graspbench.bench.result import BenchResult
from graspbench.errors import ConfigurationError

__all__ = ["BENCHMARKS", "BenchResult", "run_benchmarks"]

BENCHMARKS = {
    "clik": "graspbench.bench.clik",
}


def run_benchmarks(
    names: Sequence[str], output_dir: Path, say: Callable[[str], object]
) -> Iterator[BenchResult]:
    """Run benchmarks one after the other.

    Args:
        names: Any of `BENCHMARKS`.
        output_dir: Where plots go.
        say: Called with the name of each benchmark as it starts.

    Raises:
        ConfigurationError: There is no benchmark of such a name; nothing is run then.
    """
    for name in names:
        if name not in BENCHMARKS:
            raise ConfigurationError(
                f"unknown benchmark '{name}'", remedy=f"choose from {', '.join(BENCHMARKS)}", name=name
            )
    for name in names:
        say(f"measuring {name}")
        yield import_module(BENCHMARKS[name]).run(output_dir=output_dir)
