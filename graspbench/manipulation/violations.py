"""How checks of in-hand motions say what is violated."""


def beyond(clause: str, value: float, limit: float) -> list[str]:
    """Return a clause with the value in its braces where that is beyond the limit, else nothing."""
    return [] if value <= limit else [clause.format(value)]
