"""The command line: parse, call, print. The work is done in the packages beside it."""
