"""What an inspection may be told to do, by name. First the methods of projection: how the foot of a point is found.

exact      the closest point of the curve itself
circle     projection on the osculating circle of the nearest sample (third order; Hu & Wallner 2005 is a relative)
chord      projection on the polygon of the samples
pcp        pole circle projection, equations 2 and 3 of Hari Ganesh & Samuel (2022), the circle on the point's side
veaw       Voronoi edge assisted weighting, equations 4 to 6 there, angles at the end of the shared Voronoi edge
hermite    the closest point of the cubic Hermite pieces between neighbouring samples (fourth order; see `hermite`)
inversion  point inversion started at the nearest sample, the published method's comparison
"""

from typing import Literal

Method = Literal["exact", "circle", "chord", "pcp", "veaw", "hermite", "inversion"]
Material = Literal["left", "right"]  # the side of the curve that the material lies on
FitName = Literal["best-fit", "minimum-zone", "none"]
RuleName = Literal["minimum-zone", "best-fit"]  # what decides where there is no datum
WeightName = Literal["arc-length", "points"]
