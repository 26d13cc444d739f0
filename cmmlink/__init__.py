"""The application: plans, runs, records, reports and the command line."""

__version__ = "0.1.0"
