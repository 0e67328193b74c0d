"""Many trials: the grid, the engines that run it, and the search for better parameters."""
