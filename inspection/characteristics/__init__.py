"""What is evaluated of a section beside its profile: the characteristics of an airfoil, each by a named method."""
