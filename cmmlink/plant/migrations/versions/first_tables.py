"""The first tables: stations, runs, characteristics and their values, strips of deviations along the profile, and events."""

import sqlalchemy as sa
from alembic import op

revision = "1"
down_revision = None

_KEY = sa.BigInteger().with_variant(sa.Integer(), "sqlite")  # SQLite counts only INTEGER up by itself
_MOMENT = sa.DateTime(timezone=True).with_variant(sa.Double(), "sqlite")


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "station",
        sa.Column("id", _KEY, primary_key=True),
        sa.Column("name", sa.Text(), nullable=False),
        sa.UniqueConstraint("name", name="station_name"),
    )
    op.create_table(
        "run",
        sa.Column("id", _KEY, primary_key=True),
        sa.Column("station_id", _KEY, sa.ForeignKey("station.id", name="run_station"), nullable=False),
        *[sa.Column(name, sa.Text(), nullable=False) for name in ("run", "part", "section", "serial_number", "operator")],
        sa.Column("started", _MOMENT, nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("verdict", sa.Text()),
        *[sa.Column(name, sa.Text(), nullable=False) for name in ("software", "chain_sha256", "plan_sha256", "nominal_sha256")],
        *[sa.Column(name, sa.BigInteger()) for name in ("received", "judged", "rejected", "lost", "damaged_bytes")],
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.UniqueConstraint("station_id", "run", name="run_of_station"),
    )
    op.create_index("run_of_part", "run", ["part", "started"])
    op.create_index("run_started", "run", ["started"])
    op.create_index("run_of_serial_number", "run", ["serial_number"])
    op.create_table(
        "characteristic",
        sa.Column("id", _KEY, primary_key=True),
        *[sa.Column(name, sa.Text(), nullable=False) for name in ("part", "name", "type", "unit")],
        sa.UniqueConstraint("part", "name", "type", "unit", name="characteristic_of_part"),
    )
    op.create_table(
        "characteristic_value",
        sa.Column("run_id", _KEY, sa.ForeignKey("run.id", name="value_run"), primary_key=True, autoincrement=False),
        sa.Column(
            "characteristic_id",
            _KEY,
            sa.ForeignKey("characteristic.id", name="value_characteristic"),
            primary_key=True,
            autoincrement=False,
        ),
        sa.Column("started", _MOMENT, nullable=False),
        *[sa.Column(name, sa.Double()) for name in ("value", "lower", "upper", "uncertainty")],
        sa.Column("verdict", sa.Text(), nullable=False),
    )
    op.create_index("value_of_characteristic", "characteristic_value", ["characteristic_id", "started"])
    op.create_table(
        "profile_strip",
        sa.Column("run_id", _KEY, sa.ForeignKey("run.id", name="strip_run"), primary_key=True, autoincrement=False),
        *[sa.Column(name, sa.Double(), nullable=name != "length_mm") for name in ("length_mm", "lower_mm", "upper_mm")],
        *[sa.Column(name, sa.LargeBinary(), nullable=False) for name in ("mean_mm", "worst_mm")],
    )
    op.create_table(
        "event",
        sa.Column("id", _KEY, primary_key=True),
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("at", _MOMENT, nullable=False),
        *[sa.Column(name, sa.Text(), nullable=False) for name in ("kind", "station", "part", "characteristic", "run", "who", "words")],
        sa.UniqueConstraint("key", name="event_key"),
    )
    op.create_index("event_at", "event", ["at"])
