#!/usr/bin/python3
"""Six scenes that no constant of the model study was chosen on, solved at CalculiX's coarse level (two minutes).

example: apps/lab/reference/study_held_out.py /tmp/held && apps/lab/reference/model_study.py --scenes /tmp/held --only
capsule
"""
import json
import pathlib
import sys
import tempfile

import run
import stored
from scene import load_scene

if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
    sys.exit(__doc__)
root = pathlib.Path(sys.argv[1])
root.mkdir(parents=True, exist_ok=True)
S={ # name: size, held, mu, nu, centre, semi, kgl, R, load, mesh
'h1_thin':([96,96,96],None,2,.49,[4,0,-3],[20,20,16],6,1.0,('shaft',[7,0,-30],[7,0,2],[0,0,3],3),(.5,3.2)),
'h2_ratio8':([96,96,96],None,1,.49,[0,0,0],[24,18,21],8,1.5,('shaft',[-24,0,-28],[8,0,5],[1.5,0,1.5],4),(.75,3.2)),
'h3_softer':([96,96,96],None,6,.45,[0,0,0],[22,22,18],2,2.0,('shaft',[3,0,-34],[3,0,0],[2,0,0],5),(1.,3.2)),
'h4_push':([110,90,100],None,3,.45,[0,0,5],[22,17,20],9,3.0,('contact',[0,0,-15],[0,0,-15],[0,0,3],3),(.08,3.2)),
'h5_thin_hom':([96,96,96],None,5,.4,[0,0,0],[24,18,21],5,.8,('shaft',[-10,0,-34],[2,0,6],[0.9,0,3],4),(.4,3.2)),
'h6_free':([96,96,96],["-x","+x","-y","+y","+z"],2,.48,[0,0,-8],[24,18,21],6,1.5,
            ('shaft',[0,0,-60],[0,0,-4],[0,0,3],4),(.75,3.2)),
}
for n,(size,held,mu,nu,c,a,kg,R,(kind,st,tip,d,sp),(mn,mg)) in S.items():
    f=root/n; f.mkdir(exist_ok=True)
    held=held or ["-x","+x","-y","+y","-z","+z"]
    (f/'scene.toml').write_text(f"""[box]
size_mm = {size}
held = {json.dumps(held)}
[tissue]
shear_modulus_kpa = {mu}
poisson = {nu}
[[region]]
shape = "ellipsoid"
centre_mm = {c}
semi_axes_mm = {a}
shear_modulus_kpa = {kg}
[needle]
radius_mm = {R}
""")
    (f/'load.toml').write_text(f"""symmetry = ["y"]
[load]
kind = "{kind}"
"""+(f"start_mm = {st}\n" if kind=='shaft' else "")+f"""tip_mm = {tip}
displacement_mm = {d}
landmark_spacing_mm = {sp}
[mesh]
needle_mm = {mn}
gland_mm = {mg}
growth = 0.4
""")
    scene = load_scene(f)
    points, _ = stored.evaluation_points(scene)
    with tempfile.TemporaryDirectory() as work:
        solution = run.Solution(scene, "coarse", points, pathlib.Path(work), 600)
    stored._write_vectors(f / "field.csv", points, solution.displacements[-1])
    landmarks = scene.landmarks()
    stored._write_vectors(f / "landmarks.csv", landmarks[:, :3], landmarks[:, 3:])
