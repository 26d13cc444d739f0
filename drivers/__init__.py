"""Devices, and files of points, to batches of points in millimetres."""
