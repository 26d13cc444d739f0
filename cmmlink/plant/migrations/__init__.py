"""How the results database came to its tables, one file a step; `database_engine` takes the steps that a database lacks."""
