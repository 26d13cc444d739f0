"""The application: plans, runs, records, reports and the command line."""
