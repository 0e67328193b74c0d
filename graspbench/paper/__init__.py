"""The thesis' experiments, each with its tables and figures."""
