"""Grasps planned anywhere, judged alike: formats in and out, the judge, the protocols, what they agree on."""
