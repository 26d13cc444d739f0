"""The operator console: one page on the measurement PC that says at a glance whether the part is good."""
