"""Pictures, tables and pages made of trials.

Names are imported on first use: Matplotlib and pandas take longer to load than a trial takes to plan.
"""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
    from graspbench.report.comparison import comparison_table
    from graspbench.report.figures import draw_grasp, draw_surface_moments, draw_views, pick_moments
    from graspbench.report.statistics import aggregate, spearman, wilson_interval
    from graspbench.report.tables import Column, Table, write_tables

_HOMES = {
    "Column": "tables",
    "Table": "tables",
    "aggregate": "statistics",
    "comparison_table": "comparison",
    "draw_grasp": "figures",
    "draw_surface_moments": "figures",
    "draw_views": "figures",
    "pick_moments": "figures",
    "spearman": "statistics",
    "wilson_interval": "statistics",
    "write_tables": "tables",
}

__all__ = [
    "Column",
    "Table",
    "aggregate",
    "comparison_table",
    "draw_grasp",
    "draw_surface_moments",
    "draw_views",
    "pick_moments",
    "spearman",
    "wilson_interval",
    "write_tables",
]

__getattr__ = loads_on_use(__name__, _HOMES)
