"""Pictures of the comparison of local and global grasps: all ratios, and the grasps where one is low."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspbench.report import style
from graspbench.report.comparison import TITLE
from graspbench.report.figures import grasp_image, grasp_legend
from graspbench.report.local_global import REFINED_GOAL

if TYPE_CHECKING:
    from graspbench.grasp.configuration import Grasp
    from graspbench.reconstruction.surface import Surface

_TILE = (420, 380)
_LOCAL, _REFINED, _THESIS = "#b3202a", "#1f6fb4", "#22262b"


def draw_ratios(rows: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw local / global and refined / global of every row, with the thesis' marks; a panel a measure.

    Args:
        rows: Rows of the comparison.
        path: PNG file to write.
    """
    measures = list(dict.fromkeys(row["measure"] for row in rows))
    figure = style.canvas(1500, 520)
    for panel, measure in zip(figure.subplots(1, len(measures), squeeze=False)[0], measures, strict=True):
        chosen = [row for row in rows if row["measure"] == measure]
        names = [_label(row) for row in chosen]
        for key, marker, colour, label in (
            ("ratio", "o", _LOCAL, "local / global"),
            ("ratio_refined", "^", _REFINED, "refined / global"),
            ("thesis", "_", _THESIS, "thesis, local / global"),
        ):
            there = [(name, row[key]) for name, row in enumerate(chosen) if row[key] is not None]
            wide = {"ms": 15, "mew": 2.5} if marker == "_" else {"ms": 7}
            panel.plot(*zip(*there, strict=True) if there else ([], []), ls="", marker=marker, color=colour,
                       label=label, **wide)  # fmt: skip
        panel.axhline(REFINED_GOAL, color=_REFINED, lw=0.8, ls=":")
        panel.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=9)
        panel.set(ylim=(0.0, 1.05), title=measure)
        panel.grid(True, axis="y", alpha=0.3)
    figure.axes[0].legend(fontsize=9, loc="lower left")
    figure.suptitle(TITLE, fontsize=13)
    figure.tight_layout()
    return style.save(figure, path)


def draw_grasps(surface: Surface, grasps: Mapping[str, Grasp], path: Path, title: str, caption: str) -> Path:
    """Draw several grasps on one surface side by side, each from where its contacts are seen best.

    Args:
        surface: The surface at rest.
        grasps: The grasps by what is written below each.
        path: PNG file to write.
        title: First line.
        caption: Sentence below it; it is broken into lines.
    """
    head, foot = 96, 64
    width = _TILE[0] * len(grasps)
    figure = style.canvas(width, head + _TILE[1] + foot)
    for k, (label, grasp) in enumerate(grasps.items()):
        style.place(figure, grasp_image(surface, grasp, (), _TILE), k * _TILE[0], head)
        style.write(figure, label, (k + 0.5) * _TILE[0], head + _TILE[1] + 2, 12, ha="center")
    style.write(figure, title, 18, 12, 14, weight="bold")
    style.write(figure, _broken(caption, width // 7), 18, 40, 10)
    figure.legend(
        handles=grasp_legend(with_paths=False), loc="lower center", frameon=False, fontsize=11, ncols=2
    )
    return style.save(figure, path)


def _label(row: Mapping[str, Any]) -> str:
    gain = "" if row["k_cm"] is None else f", k_cm {row['k_cm']:g}"
    return f"{row['object']} ({row['fingers']}){gain}".replace("_", " ")


def _broken(text: str, columns: int) -> str:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > columns:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
