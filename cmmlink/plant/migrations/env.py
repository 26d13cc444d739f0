"""Runs the steps on the connection that the program hands over; Alembic loads this file."""

from alembic import context

from cmmlink.plant.results_tables import VERSION_TABLE

context.configure(connection=context.config.attributes["connection"], version_table=VERSION_TABLE, transactional_ddl=False)
context.run_migrations()
