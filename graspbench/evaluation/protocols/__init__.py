"""The protocols: what a grasp must do in physics to be a success; one module each."""
