"""Surfaces: meshes read, cut, and chained into contours."""
