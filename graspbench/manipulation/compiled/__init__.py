"""The compiled half of the inverse kinematics: data declared once (`record`), and the kernels that use it."""
