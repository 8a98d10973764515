"""One piece of surface: differential geometry on arrays, numpy and scipy only.

Conventions, for the whole package
----------------------------------
* The unit normal points out of the body, to the probe. Height z is measured along it.
* A curvature is positive where the surface bends toward the normal (a dimple) and negative
  where it bends away: a ball of radius r has k1 = k2 = -1/r. k1 >= k2 in value. (e1, e2, n)
  is right-handed and e1 belongs to k1.
* In its Darboux frame a patch is z = (k1 x^2 + k2 y^2)/2 + terms of order 3 and more:
  equation (1) of the paper ("Surface Patch Reconstruction via Curve Sampling").
* Any one length unit. Coefficients are kept in scaled coordinates (x/R, y/R, z/R), R the
  patch radius.
* World frame unless the name ends in ``_local``.
* At an umbilic point directions are chosen, not measured, and ``umbilic`` is true.
"""
