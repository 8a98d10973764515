"""The paper's own estimator: total absolute Gaussian curvature, its solvers, the Gauss map."""
