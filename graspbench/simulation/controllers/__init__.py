"""Controllers of the fingers while they grip."""
