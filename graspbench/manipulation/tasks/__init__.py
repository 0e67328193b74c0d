"""Secondary tasks, one a file; each registers itself under the name used in the configuration."""
