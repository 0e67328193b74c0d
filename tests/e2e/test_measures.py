"""``graspbench measures``, and measures that a configuration asks for."""


def test_measures_are_listed_with_their_definitions(cli):
    rows = cli("measures", "list", "--json").document
    isotropy = next(row for row in rows if row["name"] == "isotropy")
    assert isotropy["range"] == "[0, 1]"
    assert "singular value" in isotropy["definition"]


def test_an_unknown_measure_is_refused_before_anything_runs(cli):
    finished = cli("config", "quality.measures=[isotropy,beauty]")
    assert finished.code == 2
    assert "beauty" in finished.stderr
    assert "hull_volume" in finished.stderr
