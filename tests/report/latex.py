"""LaTeX where it is installed: does a text compile, and does everything fit?"""

import shutil
import subprocess
from pathlib import Path

AVAILABLE = shutil.which("pdflatex") is not None
REASON = "no LaTeX here (tests/system-tools installs it)"


def compiled(folder: Path, *texts: str) -> str:
    """Set texts in a two-column article and return LaTeX's log; it must compile."""
    inputs = []
    for k, text in enumerate(texts):
        (folder / f"part_{k}.tex").write_text(text, encoding="utf-8")
        inputs.append(rf"\input{{part_{k}}}\clearpage")
    (folder / "paper.tex").write_text(
        "\\documentclass[twocolumn]{article}\\usepackage{booktabs}\\begin{document}\n"
        + "\n".join(inputs)
        + "\n\\end{document}\n"
    )
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, errors="replace")
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout
