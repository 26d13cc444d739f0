"""The qualification of an installation: the reference set judged on it, and the certificate of that. This is the front door."""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.qualification.budget import QUANTITIES, Quantity
    from cmmlink.qualification.certificate import is_unaltered, last_from, qualify
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.qualification.budget": ("QUANTITIES", "Quantity"),
        "cmmlink.qualification.certificate": ("is_unaltered", "last_from", "qualify"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = ["QUANTITIES", "Quantity", "is_unaltered", "last_from", "qualify"]
