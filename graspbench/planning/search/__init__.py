"""Best-first branch and bound over clusters of surface nodes."""
