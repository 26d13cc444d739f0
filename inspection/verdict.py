"""The three-state verdict of ISO 14253-1 on a point and on a profile, and why a point has none."""

from enum import IntEnum

from inspection.kernels import layout

NOT_JUDGED = layout.NOT_JUDGED  # in place of a verdict where a point was rejected, or is not judged yet


class Verdict(IntEnum):
    """Ordered so that the verdict on a profile is the maximum over its points."""

    CONFORM = layout.CONFORM
    UNCERTAIN = layout.UNCERTAIN
    NONCONFORM = layout.NONCONFORM

    @property
    def word(self) -> str:
        """The word that results and JSON use, which never changes: conform, uncertain, nonconform."""
        return self.name.lower()


class Rejection(IntEnum):
    """Why a received point was not judged."""

    NONE = layout.NOT_REJECTED
    NOT_FINITE = layout.NOT_FINITE
    OFF_SECTION = layout.OFF_SECTION
    BEYOND_END = layout.BEYOND_END
    OUTLIER = layout.OUTLIER
    IN_HOLLOW = layout.IN_HOLLOW
    OFF_SURFACE = layout.OFF_SURFACE
    BEYOND_EDGE = layout.BEYOND_EDGE
    OPPOSITE_FACE = layout.OPPOSITE_FACE

    @property
    def words(self) -> str:
        """The reason as results spell it."""
        return self.name.lower().replace("_", " ")
