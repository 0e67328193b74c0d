"""Contacts that slide over the object on purpose, with friction, while the others hold it."""
