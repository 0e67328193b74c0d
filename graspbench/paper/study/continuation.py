"""The study's table made longer, case by case: each case is one process' work and is kept when it is done."""

from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from itertools import count, islice
from multiprocessing import get_context
from pathlib import Path

import pandas as pd

from graspbench.paper.paper_result import Say
from graspbench.paper.study.generation import rows_of_case
from graspbench.paper.study.table import Row, read_table, with_rows, write_table

MAX_CASES = 3000
MAX_EMPTY = 20
"""Cases in a row that give no grasp, after which something is wrong."""


def continued(path: Path, start: pd.DataFrame | None, grasps: int, jobs: int, say: Say) -> pd.DataFrame:
    """Return a table of at least so many grasps; stored after each case, so that it can be stopped any time.

    Args:
        path: Where it is kept; what is there already is gone on with.
        start: What to go on from where there is nothing.
        grasps: Rows wanted.
        jobs: Cases at a time.
        say: Told about the progress.
    """
    frame = read_table(path) if path.is_file() else start
    done = set() if frame is None else {int(number) for number in frame["case"].unique()}
    empty: list[int] = []
    numbers = (number for number in islice(count(), MAX_CASES) if number not in done)
    have = 0 if frame is None else len(frame)
    with ExitStack() as stack:
        pool = (
            stack.enter_context(ProcessPoolExecutor(jobs, mp_context=get_context("spawn")))
            if jobs > 1
            else None
        )
        while have < grasps and len(empty) < MAX_EMPTY:
            batch = list(islice(numbers, max(jobs, 1)))
            if not batch:
                break
            made = map(_rows, batch) if pool is None else pool.map(_rows, batch)
            for number, rows in zip(batch, made, strict=True):
                if not rows:
                    empty.append(number)
                    continue
                frame = with_rows(frame, rows)
                have = len(frame)
                path.parent.mkdir(parents=True, exist_ok=True)
                write_table(frame, path)
                say(f"{have}/{grasps} grasps: {rows[0]['object']}, {len(rows)} of them")
    return with_rows(frame, [])


def _rows(number: int) -> list[Row]:
    return list(rows_of_case(number))
