"""Pictures, tables and pages made of trials."""

from graspbench.report.comparison import comparison_table
from graspbench.report.figures import draw_grasp, draw_surface_moments, draw_views, pick_moments
from graspbench.report.statistics import aggregate, spearman, wilson_interval
from graspbench.report.tables import write_table

__all__ = [
    "aggregate",
    "comparison_table",
    "draw_grasp",
    "draw_surface_moments",
    "draw_views",
    "pick_moments",
    "spearman",
    "wilson_interval",
    "write_table",
]
