#!/usr/bin/python3
"""Prints the constants of tests/core/elasticity/surface_remainder_test.cpp: the model `elastic` by the study's Python.

Four points, two in the gland, on two stored scenes: C g for g = (1, 2, …, 12), and the displacements at three points of
the gland when the four are displaced by d. Shear modulus 1 outside the gland. Exit code: 0 done.
"""
import numpy as np

import study_models as lm
import model_study as study

P = np.array([[1, 2, 3], [-4, 5, -6], [3, -2, -38], [25, 20, 10.0]])
S = np.array([1, 2, 0.5, 3])
D = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, -1, 0.5]])
X = np.array([[0, 0, 1], [10, -8, 5], [-15, 5, -10.0]])

for name in ("straight_stiff", "free_face_stiff_lateral"):
    case, out = lm.Case(name), {}
    case.X = X
    needle = lm.Points(P, S), D
    u = lm.elastic_condensed(case, needle, study.walls(case), study.free(case), study.capsule(case, 200, 0.7), out=out)
    print(name)
    for values in (out["C"] @ np.arange(1, 13), u.ravel()):
        print("   ", ", ".join(f"{v:.15g}" for v in values))
