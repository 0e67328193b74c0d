"""What can carry a hand: one module a mount, chosen by name in `choice`."""
