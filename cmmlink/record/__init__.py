"""The hash-chained record of every run: written, read, replayed, exported."""
