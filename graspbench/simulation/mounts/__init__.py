"""What can carry a hand: a floating wrist, or an arm read from a URDF; chosen in `choice`."""
