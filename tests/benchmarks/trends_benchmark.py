"""How long the view of trends waits for a results database with many runs, on PostgreSQL.

    python -m tests.benchmarks.trends_benchmark [RUNS]

RUNS (100,000) runs of twenty parts at four stations with ten characteristics and a profile each are made inside the database by
statements of its own, since only looking is measured. Then a page is looked at as the console does it: the database is opened, the
choices and the trend of one characteristic are read, charts, capability, heat strip and drift are worked out, and both are written as
JSON. Characteristics of form and of size take turns, so do the numbers of runs that a page offers.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cmmlink.console.protocol import json_of
from cmmlink.console.trend_look import AskedTrend, TrendLook
from cmmlink.plant import ResultsDatabase
from tests.benchmarks.machine import machine
from tests.cmmlink.plant.postgres import PostgresServer
from tests.cmmlink.plant.results import a_run

PARTS, STATIONS, CHARACTERISTICS, LOOKS = 20, 4, 10, 10
LIMIT_S = 0.3

_RUNS = """
INSERT INTO run ({columns})
SELECT {values} FROM generate_series(0, {last}) AS k CROSS JOIN (SELECT * FROM run ORDER BY id LIMIT 1) AS one
"""
_CHANGED = {
    "station_id": f"1 + k % {STATIONS}",
    "run": "'run-' || k",
    "part": f"'part ' || k % {PARTS}",
    "serial_number": "'SN ' || k",
    "started": "timestamptz '2024-01-01' + k * interval '10 minutes'",
}


def fill(server: PostgresServer, runs: int) -> None:
    """Fill an empty database: one run by the program, so that the tables are its own, and the others after its likeness."""
    with ResultsDatabase(server.address) as results:
        results.add_runs([a_run(k, station=f"hall-{k}") for k in range(STATIONS)])
    columns = server.query(
        "SELECT string_agg(column_name, ',') FROM information_schema.columns WHERE table_name='run' AND column_name<>'id'"
    )
    values = ", ".join(_CHANGED.get(name, f"one.{name}") for name in columns.split(","))
    server.query(_RUNS.format(columns=columns, values=values, last=runs - 1))
    server.query(f"""
        INSERT INTO characteristic (part, name, type, unit)
        SELECT 'part ' || p, CASE WHEN c % 2 = 0 THEN 'form ' ELSE 'size ' END || c,
               CASE WHEN c % 2 = 0 THEN 'line-profile' ELSE 'chord' END, 'mm'
        FROM generate_series(0, {PARTS - 1}) AS p, generate_series(0, {CHARACTERISTICS - 1}) AS c""")
    normal = "sqrt(-2 * ln(1 - random())) * cos(6.283185307 * random())"
    server.query(f"""
        INSERT INTO characteristic_value (run_id, characteristic_id, started, value, lower, upper, uncertainty, verdict)
        SELECT r.id, c.id, r.started, CASE WHEN c.type = 'chord' THEN 60 + 0.01 * {normal} ELSE abs(0.02 + 0.006 * {normal}) END,
               CASE WHEN c.type = 'chord' THEN 59.95 END, CASE WHEN c.type = 'chord' THEN 60.05 ELSE 0.05 END, 0.002, 'conform'
        FROM run AS r JOIN characteristic AS c ON c.part = r.part WHERE r.part LIKE 'part %'""")
    server.query("""
        INSERT INTO profile_strip (run_id, length_mm, lower_mm, upper_mm, mean_mm, worst_mm)
        SELECT r.id, 123.5, -0.05, 0.05, s.mean_mm, s.worst_mm FROM run AS r
        CROSS JOIN (SELECT * FROM profile_strip ORDER BY run_id LIMIT 1) AS s WHERE r.part LIKE 'part %'""")
    server.query("ANALYZE")


def seconds(work: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    work()
    return time.perf_counter() - began_s


def main(runs: int) -> None:
    """Print a line for each number of runs that a page offers."""
    print(machine("sqlalchemy", "psycopg", "numpy", "scipy"))
    server = PostgresServer()
    try:
        print(f"filled in {seconds(lambda: fill(server, runs)):.0f} s: {server.query('SELECT count(*) FROM characteristic_value')} values")
        look = TrendLook(lambda: ResultsDatabase(server.address), Path())
        print(f"first look, with loading: {seconds(look.choices):.2f} s")
        choices = [seconds(lambda: json_of(look.choices())) for _ in range(LOOKS)]
        print(f"choices: median {np.median(choices):.3f} s, worst {max(choices):.3f} s")
        for last in (25, 100, 500):
            asked = [AskedTrend(f"part {k % PARTS}", ("form 0", "size 1")[k % 2], None, last, 1) for k in range(LOOKS)]
            took = [seconds(lambda one=one: json_of(look.trend(one))) for one in asked]  # type: ignore[misc]
            print(f"trend of {last} runs: median {np.median(took):.3f} s, worst {max(took):.3f} s (at most {LIMIT_S:g} s are wanted)")
    finally:
        server.close()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
