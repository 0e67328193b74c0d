"""Results: what a trial gives, typed to the leaves, and its folder on disk."""
