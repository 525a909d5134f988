#!/usr/bin/env python3
"""brachyd.Simulator, the engine in this process: the bits of `brachy replay --offline`, views, seeds, dose, threads.

usage: tests/python/simulator_test.py FOLDER_OF_THE_MODULE BRACHY     exit code 77: skipped, with its reason
"""
import gc
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "apps/python/examples"
sys.path.insert(0, str(ROOT / "apps/python"))
try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is missing")
    sys.exit(77)
if len(sys.argv) < 3:
    sys.exit(__doc__)
FOLDER, BRACHY = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path.insert(0, FOLDER)

import brachyd

SMALL = '[tissue]\npoints = 1200\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n'


def write_trajectory(path, X, period_s, buttons=None):
    with open(path, "w", encoding="ascii") as file:
        names = [f"m{r}{c}" for r in range(3) for c in range(4)]
        file.write(",".join(["t_s", *names] + (["button"] if buttons is not None else [])) + "\n")
        for k, pose in enumerate(X):
            numbers = [repr(float(x)) for x in pose[:3].ravel()]
            file.write(",".join([repr(k * period_s), *numbers] +
                                ([str(int(buttons[k]))] if buttons is not None else [])) + "\n")


def insertion(ticks=300, at=(5, 0), deepest=10.0, start=-40.0):
    X = np.tile(np.eye(4), (ticks, 1, 1))
    X[:, 0, 3], X[:, 1, 3] = at
    X[:, 2, 3] = np.linspace(start, deepest, ticks)
    return X


class Bits(unittest.TestCase):
    """The engine is the daemon's."""

    def hash_of_replay(self, X, scene, buttons=None):
        with tempfile.TemporaryDirectory() as folder:
            trajectory, file = f"{folder}/t.csv", f"{folder}/s.toml"
            write_trajectory(trajectory, X, 0.005, buttons)
            pathlib.Path(file).write_text(scene, encoding="utf-8")
            line = [BRACHY, "replay", trajectory, "--offline", "--config", file, "--json"]
            return json.loads(subprocess.run(line, check=True, capture_output=True, text=True).stdout)

    def test_the_state_hash_is_that_of_replay_offline(self):
        X = insertion()
        for scene in (SMALL, SMALL.replace("psi31", "elastic")):
            simulator = brachyd.Simulator(text=scene, with_hash=True)
            simulator.run(X)
            self.assertEqual(simulator.state_hash, self.hash_of_replay(X, scene)["state_hash"])

    def test_a_scene_file_and_its_buttons_give_the_same_seeds(self):
        X, buttons = insertion(), np.zeros(300, dtype=bool)
        buttons[200:205] = buttons[250:260] = True
        scene = SMALL + '[seeds]\napplicator = "single"\n'
        simulator = brachyd.Simulator(text=scene, with_hash=True)
        simulator.run(X, buttons)
        self.assertEqual(len(simulator.seeds), 2)
        self.assertEqual(simulator.state_hash, self.hash_of_replay(X, scene, buttons)["state_hash"])

    def test_one_call_and_a_call_a_tick_are_the_same(self):
        X = insertion(120)
        one, many = (brachyd.Simulator(text=SMALL, with_hash=True) for _ in range(2))
        ticks = one.run(X)
        for k, pose in enumerate(X):
            many.step(pose[:3] if k % 2 else pose)
            np.testing.assert_array_equal(many.needles[0].forces.force_n, ticks.force_n[k, 0])
            self.assertEqual(many.certificate.verdict, ticks.verdict[k])
        self.assertEqual(one.state_hash, many.state_hash)

    def test_a_reset_starts_from_the_beginning(self):
        simulator = brachyd.Simulator(text=SMALL, with_hash=True)
        positions = simulator.positions
        simulator.run(insertion())
        first = simulator.state_hash
        self.assertFalse(np.array_equal(positions, simulator.rest_positions))
        simulator.reset()
        np.testing.assert_array_equal(positions, simulator.rest_positions)
        self.assertEqual((simulator.tick, simulator.sim_time_s), (0, 0.0))
        simulator.run(insertion())
        self.assertEqual(simulator.state_hash, first)


class Views(unittest.TestCase):
    def test_the_mesh_is_a_view_that_follows_and_cannot_be_written(self):
        simulator = brachyd.Simulator(text=SMALL)
        positions, triangles = simulator.positions, simulator.triangles
        self.assertEqual((positions.shape, positions.dtype), ((1200, 3), np.float32))
        self.assertEqual(positions.__array_interface__["data"], simulator.positions.__array_interface__["data"])
        self.assertLess(triangles.max(), simulator.surface_vertex_count)
        for view in (positions, triangles, simulator.rest_positions):
            with self.assertRaises(ValueError):
                view[0, 0] = 0
        simulator.run(insertion())
        moved = np.linalg.norm(positions - simulator.rest_positions, axis=1).max()
        self.assertAlmostEqual(moved, simulator.max_displacement_mm, places=4)

    def test_a_view_outlives_its_simulator(self):
        simulator = brachyd.Simulator(text=SMALL)
        positions = simulator.positions
        expected = positions.copy()
        del simulator
        gc.collect()
        np.testing.assert_array_equal(positions, expected)


class Observations(unittest.TestCase):
    def test_a_row_has_what_the_properties_have(self):
        simulator = brachyd.Simulator(text='[tissue]\npoints = 1200\nphantom_surface_vertices = 400\n'
                                      '[needle]\nflexible = true\nbevel_force_share = 0.2\n')
        at = simulator.observation_fields
        self.assertEqual(len(simulator.observe()), max(field.stop for field in at.values()))
        X = insertion(at=(5, 5))
        ticks = simulator.run(X)
        row, needle, certificate = simulator.observe(), simulator.needles[0], simulator.certificate
        self.assertTrue(np.isfinite(row).all())
        np.testing.assert_allclose(row[at["tip_mm"]], needle.shape[-1], rtol=1e-6)  # float on the wire
        np.testing.assert_array_equal(row[at["tip_mm"]], ticks.tip_mm[-1, 0])
        np.testing.assert_allclose(row[at["bend_mm"]][:2], row[at["tip_mm"]][:2] - X[-1, :2, 3], atol=1e-9)
        self.assertAlmostEqual(np.linalg.norm(row[at["tip_axis"]]), 1, places=9)
        for name, value in (("force_n", needle.forces.force_n), ("axial_n", needle.forces.axial_n),
                            ("lateral_n", needle.forces.lateral_n), ("friction_n", needle.forces.friction_n),
                            ("cutting_n", needle.forces.cutting_n), ("tip_depth_mm", needle.tip_depth_mm),
                            ("contact", 2), ("organs_in", 0), ("verdict", certificate.verdict),
                            ("det_bound", certificate.det_bound), ("substeps", certificate.substeps),
                            ("max_displacement_mm", simulator.max_displacement_mm),
                            ("step_flags", simulator.step_flags), ("lag_mm", 0)):
            np.testing.assert_array_equal(row[at[name]], np.atleast_1d(value), name)
        # A seed that is dropped there rests at the tip's material point.
        seed, = simulator.drop(X[-1])
        np.testing.assert_allclose(row[at["tip_rest_mm"]], seed.rest, atol=0.05)
        self.assertGreater(np.linalg.norm(row[at["tip_mm"]] - seed.rest), 1.0, "not where it is deformed")

    def test_a_needle_in_an_organ_says_so(self):
        simulator = brachyd.Simulator(text=SMALL)
        at = simulator.observation_fields
        simulator.run(insertion(at=(0, 0)))  # through the urethra
        row = simulator.observe()
        self.assertEqual((row[at["organs_in"]][0], row[at["organ_passes"]][0]), (1, 1))

    def test_the_row_is_the_callers(self):
        simulator = brachyd.Simulator(text=SMALL)
        rows = np.zeros((2, len(simulator.observe())))
        self.assertIs(simulator.observe(out=rows[1]).base, rows)
        np.testing.assert_array_equal(rows[1], simulator.observe())
        for out in (np.zeros(3), np.zeros(len(rows[0]), dtype=np.float32), rows[:, :1],
                    np.zeros(2 * len(rows[0]))[::2]):
            with self.assertRaises((ValueError, TypeError)):
                simulator.observe(out=out)
        with self.assertRaisesRegex(IndexError, "needle 1, and the scene has 1"):
            simulator.observe(1)

    def test_depths_are_those_inside_tissue_and_organs(self):
        inside = brachyd.Simulator(text=SMALL).depths_of([[0, -2, 0], [10, -2, 0], [0, 0, 100]])
        self.assertEqual(list(inside)[0], "tissue")
        self.assertGreater(inside["urethra"][0], 0)
        self.assertLess(inside["urethra"][1], -6)
        self.assertGreater(inside["tissue"][1], 5)
        self.assertAlmostEqual(inside["tissue"][2], -77.5, delta=1.0)

    def test_another_of_the_same_scene_is_on_its_own(self):
        one = brachyd.Simulator(text=SMALL, with_hash=True)
        one.run(insertion())
        two = brachyd.Simulator(like=one, with_hash=True)
        self.assertEqual(two.tick, 0)
        np.testing.assert_array_equal(two.positions, two.rest_positions)
        two.run(insertion())
        self.assertEqual(two.state_hash, one.state_hash)
        with self.assertRaisesRegex(ValueError, "like"):
            brachyd.Simulator(text=SMALL, like=one)


class Physics(unittest.TestCase):
    def test_the_certificate_forces_and_seeds_are_those_of_the_wire(self):
        simulator = brachyd.Simulator(text=SMALL)
        X = insertion()
        ticks = simulator.run(X)
        needle = simulator.needles[0]
        self.assertEqual(needle.contact, 2)
        np.testing.assert_allclose(needle.forces.axial_n, needle.forces.cutting_n + needle.forces.friction_n)
        self.assertEqual(needle.forces.axial_n, ticks.axial_n[-1, 0])
        self.assertGreater(ticks.axial_n.max(), 3.0)
        self.assertEqual(simulator.certificate.verdict, 1)
        self.assertGreater(simulator.certificate.det_bound, 0)
        fallen = simulator.drop(X[-1])
        self.assertEqual([seed.id for seed in fallen], [1])
        np.testing.assert_array_equal(fallen[0].dropped, X[-1, :3, 3])
        self.assertEqual(simulator.drops().dropped, 1)
        simulator.run(X[::-1])
        seed = simulator.seeds[0]
        np.testing.assert_allclose(seed.position, seed.rest, atol=1e-9)

    def test_dose_is_of_the_seeds_at_rest(self):
        simulator = brachyd.Simulator(text=SMALL)
        self.assertEqual([d.mean_gy for d in simulator.dose() if d.name == "prostate"], [0.0])
        simulator.run(insertion())
        simulator.drop(insertion()[-1])
        rest = simulator.seeds[0].rest
        near, far = simulator.dose_at([rest + [5, 0, 0], rest + [10, 0, 0]])
        self.assertGreater(near, 2 * far)
        prostate = next(d for d in simulator.dose() if d.name == "prostate")
        self.assertGreater(prostate.max_gy, near)
        simulator.reset()
        self.assertEqual(simulator.dose_at([rest])[0], 0.0)

    def test_a_needle_that_is_not_there_is_nan(self):
        simulator = brachyd.Simulator(text=SMALL + "[needle]\ncount = 2\n")
        X = np.full((3, 2, 4, 4), np.nan)
        X[:, 1] = insertion(3)
        ticks = simulator.run(X)
        self.assertTrue(np.isnan(ticks.force_n[:, 0]).all() and np.isfinite(ticks.force_n[:, 1]).all())
        self.assertEqual([needle.present for needle in simulator.needles], [False, True])


class Mistakes(unittest.TestCase):
    def test_what_is_no_pose_is_refused_before_a_tick_is_made(self):
        simulator = brachyd.Simulator(text=SMALL)
        skewed, far, half, row = (insertion(3) for _ in range(4))
        skewed[1, 0, 0] = 1.1
        far[2, 2, 3] = 2e4
        half[0, 1, 1] = np.nan
        row[1, 3, 3] = 2
        for poses, why in ((skewed, "row 1 is not rigid"), (far, "10 m"), (half, "not finite"), (row, "last row")):
            with self.assertRaisesRegex(ValueError, why):
                simulator.run(poses)
        for poses, why in ((np.eye(3), "shape|arrays"), (np.zeros((2, 5, 4)), "3×4 or 4×4"),
                           (np.tile(np.eye(4), (2, 1, 1)), "2 needles")):
            with self.assertRaisesRegex(ValueError, why):
                simulator.step(poses)
        with self.assertRaisesRegex(ValueError, "2 buttons for 3 poses"):
            simulator.run(insertion(3), [True, False])
        self.assertEqual(simulator.tick, 0)

    def test_a_scene_that_cannot_be_used_is_named_with_its_line(self):
        with self.assertRaisesRegex(ValueError, r"scene:2: .*kernel"):
            brachyd.Simulator(text='[model]\nkernell = "psi31"\n')
        with self.assertRaisesRegex(ValueError, "no.toml"):
            brachyd.Simulator("/tmp/there/is/no.toml")
        with self.assertRaisesRegex(RuntimeError, "with_hash"):
            brachyd.Simulator(text=SMALL).state_hash

    def test_two_threads_do_not_step_one_simulator(self):
        simulator = brachyd.Simulator(text=SMALL)
        many = insertion(20000)
        refused, gate = [], threading.Barrier(2)

        def play():
            gate.wait()
            try:
                simulator.run(many)
            except RuntimeError as error:
                refused.append(str(error))

        threads = [threading.Thread(target=play) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        # Either one was refused while the other ran, or they followed each other; never both at once.
        self.assertEqual(simulator.tick, len(many) * (2 - len(refused)))
        self.assertTrue(all("another thread" in text for text in refused))

    def test_others_run_while_ticks_are_made(self):
        simulator = brachyd.Simulator(text=SMALL)
        thread = threading.Thread(target=simulator.run, args=(insertion(20000),))
        thread.start()
        seen = set()
        while thread.is_alive():
            seen.add(simulator.tick)
        thread.join()
        self.assertGreater(len(seen), 2, "this thread saw the other one's ticks")


class Examples(unittest.TestCase):
    def run_example(self, name, *more):
        environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'apps/python'}:{FOLDER}"}
        done = subprocess.run([sys.executable, EXAMPLES / name, *more], capture_output=True, text=True, check=False,
                              env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_force_against_depth(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder, "s.toml")
            scene.write_text(SMALL, encoding="utf-8")
            self.assertRegex(self.run_example("force_depth.py", str(scene)), r"the capsule gave way at 5\.\d\d N")

    def test_ticks_are_counted(self):
        self.assertRegex(self.run_example("ticks_per_second.py", "psi31", "400"),
                         r"14560 points, in one call: \d+ ticks/s")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
