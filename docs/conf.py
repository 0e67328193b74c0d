"""How Sphinx builds the documentation: ``sphinx-build -W docs docs/_build``."""

project = "Graspbench"
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "Graspbench"
exclude_patterns = ["_build"]
# Formulas are written as LaTeX and shown by MathJax; the sources read well without it.
extensions += ["sphinx.ext.mathjax"]
