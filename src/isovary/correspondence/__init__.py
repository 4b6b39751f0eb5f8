"""Room: base Surface, perturbed Surface -> Correspondence (thesis 4.1.4)."""

from ._audit import CorrespondenceAudit, audit
from ._closest_point import closest_point
from ._identity import identity
from ._interpolate import interpolate
from ._isometric import isometric_match
from ._normal_rays import normal_rays

__all__ = [
    "CorrespondenceAudit",
    "audit",
    "closest_point",
    "identity",
    "interpolate",
    "isometric_match",
    "normal_rays",
]
