"""The paper's own estimator: total absolute Gaussian curvature, two solvers and the Gauss map."""
