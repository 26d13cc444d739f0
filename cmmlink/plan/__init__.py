"""Plans of every kind: what may stand in them, and how they are read."""
