"""One piece of surface: differential geometry and estimation on arrays, with numpy and scipy only.

Conventions, for the whole package
----------------------------------
* The unit normal points out of the body, to the probe. Height z is measured along it.
* A curvature is positive where the surface curves toward the normal (a dimple) and negative
  where it curves away: a ball of radius r has k1 = k2 = -1/r. k1 >= k2 in value. (e1, e2, n)
  is right-handed and e1 belongs to k1.
* In its Darboux frame a patch is z = (k1 x^2 + k2 y^2)/2 + terms of order 3 and more:
  equation (1) of the paper ("Surface Patch Reconstruction via Curve Sampling").
* All lengths have one unit, which the caller chooses. Coefficients are kept in scaled coordinates
  (x/R, y/R, z/R) with the patch radius R.
* Quantities are in the world frame unless the name ends in ``_local``.
* At an umbilic point directions are chosen, not measured, and ``umbilic`` is true.

Folders
-------
``geometry`` holds the records (Contour, DarbouxFrame, Patch) and the formulas of differential
geometry; it knows no estimator. ``fit`` is the default estimator: ``fit_patch`` gives the most
probable polynomial in x, y and z. ``paper`` is the paper's own estimator: ``fit_paper`` with its
penalty on folds. To add an estimator, make a folder next to ``fit`` that imports ``geometry`` only.
Its function takes a point, contours and an outward vector, and returns a PatchFit. The laws in
``tests/laws`` say what its patch must satisfy.
"""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.patch.fit.diagnosis import Diagnosis, DiagnosisLimits, diagnose
    from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, fit_patch
    from touchatlas.patch.fit.start import UnfitError
    from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
    from touchatlas.patch.geometry.frame import DarbouxFrame
    from touchatlas.patch.geometry.patch import Patch
    from touchatlas.patch.paper.fit_paper import Penalty, fit_paper

__all__ = [
    "Contour",
    "ContourEnd",
    "DarbouxFrame",
    "Diagnosis",
    "DiagnosisLimits",
    "FitOptions",
    "Patch",
    "PatchFit",
    "Penalty",
    "SamplingPlane",
    "UnfitError",
    "diagnose",
    "fit_paper",
    "fit_patch",
]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fit.diagnosis": "Diagnosis DiagnosisLimits diagnose",
        "fit.fit_patch": "FitOptions PatchFit fit_patch",
        "fit.start": "UnfitError",
        "geometry.contour": "Contour ContourEnd SamplingPlane",
        "geometry.frame": "DarbouxFrame",
        "geometry.patch": "Patch",
        "paper.fit_paper": "Penalty fit_paper",
    },
)
