"""Planning of grasps and of the fingertips' paths to them."""
