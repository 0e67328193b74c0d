"""The planners that ship; each module registers one."""
