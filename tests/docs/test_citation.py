"""How to cite is the same wherever it stands, and valid."""

import re
import tomllib
from pathlib import Path

import yaml

TREE = Path(__file__).parents[2]


def test_the_citation_is_of_this_version():
    cited = yaml.safe_load((TREE / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((TREE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {"cff-version", "message", "title", "authors"} <= set(cited)
    assert cited["type"] == "software"
    assert (cited["version"], cited["license"]) == (project["version"], project["license"])
    (entry,) = re.findall(r"@software\{.*?\n\}", (TREE / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert f"version = {{{project['version']}}}" in entry
    (thesis,) = cited["references"]
    (other,) = re.findall(r"@phdthesis\{.*?\n\}", (TREE / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert thesis["title"] in other
    assert f"year = {{{thesis['year']}}}" in other
