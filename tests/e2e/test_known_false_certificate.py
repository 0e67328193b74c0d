"""A certificate that was wrong once: four fingers on the bottle, Q2."""


def test_the_bottles_refined_grasp_is_within_the_bound(cli, tmp_path):
    finished = cli(
        "run", "object=bottle", "hand.fingers=4", "search.measures=[q2]", "search.refine=true",
        "search.time_limit_s=60", "surface=thesis", "stations.fit=false",
        "execution=off", "record=off", "--output", tmp_path, "--json",
    )  # fmt: skip
    assert finished.code == 0, finished.stderr
    result = finished.document
    best, refined = result["global"]["q2"], result["refined"]["q2"]
    assert refined["value"] <= best["upper_bound"] * (1.0 + 1e-9)
    assert best["value"] <= best["upper_bound"] * (1.0 + 1e-9)
    assert best["value"] > 7.9  # what the posture solver misses from a cold start
