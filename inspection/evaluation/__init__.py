"""The characteristics of a section judged: each in its region, at its pose, by the rules of the whole profile."""
