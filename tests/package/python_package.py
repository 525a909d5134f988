"""Whether the installed package of Python has every file of the source and steers a needle.

usage: tests/package/python_package.py DIST_PACKAGES [SOURCE]
"""
import pathlib
import sys

installed = pathlib.Path(sys.argv[1], "brachyd")
if len(sys.argv) > 2:
    wanted = {path.name for path in pathlib.Path(sys.argv[2]).iterdir() if path.is_file()}
    missing = wanted - {path.name for path in installed.iterdir()}
    assert not missing, f"not in the package: {sorted(missing)}"
sys.path.insert(0, sys.argv[1])

import numpy as np

from brachyd.steering import SCENE, SteeringSettings
from brachyd.vector import VectorNeedleSteering

scene = SCENE.replace("1500", "500").replace("400", "200")
with VectorNeedleSteering(2, SteeringSettings(text=scene, holes_mm=((5, 5),)), processes=2) as environment:
    first, _ = environment.reset(seed=1)
    for _ in range(50):
        observations, *_ = environment.step(np.ones((2, 2)))
at = environment.observation_fields
pushed = observations[:, at["hand_mm"]] - first[:, at["hand_mm"]]
assert np.allclose(pushed, 5.0), pushed
print("two needles pushed by 5 mm on two processes")
