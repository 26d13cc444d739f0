"""Write the demonstration's nominal file anew: `python -m cmmlink.demo`."""

from cmmlink.demo import plan_file
from cmmlink.demo.section import nominal_csv

plan_file().with_name("nominal.csv").write_text(nominal_csv(), encoding="utf-8", newline="\n")
