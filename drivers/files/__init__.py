"""Files of points, and tables of numbers from any text."""
