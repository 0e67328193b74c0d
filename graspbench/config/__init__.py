"""Configuration: the typed schema, its composition by Hydra's grammar, and the reference written from it."""
