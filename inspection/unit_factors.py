"""By which factors a scan is too small or too large when a unit was mistaken, and what to do then."""

UNIT_FACTORS = (  # what the points are to be multiplied by, the likeliest first
    (25.4, "are the points in inches? Say so: unit inch (--unit inch), a factor of 25.4"),
    (1 / 25.4, "is the nominal in inches? Say so: unit inch (--nominal-unit inch), a factor of 25.4"),
    (1000.0, "are the points in metres? Give their scale: a factor of 1000"),
    (0.001, "are the points in micrometres? Say so: unit um (--unit um), a factor of 0.001"),
    (10.0, "are the points in centimetres? Give their scale: a factor of 10"),
    (0.1, "is the nominal in centimetres? Give its scale: a factor of 10"),
)
