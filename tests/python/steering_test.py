#!/usr/bin/env python3
"""The steering environment, alone and on several processes: ticks, bits, targets that can be reached, and its end.

usage: tests/python/steering_test.py FOLDER_OF_THE_MODULE     exit code 77: skipped, with its reason
"""
import os
import pathlib
import select
import signal
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "apps/python"))
try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is missing")
    sys.exit(77)
if len(sys.argv) < 2:
    sys.exit(__doc__)
FOLDER = os.path.abspath(sys.argv[1])
sys.path.insert(0, FOLDER)

from brachyd.baselines import BevelFlip, ModelPredictive, StraightInsertion, play
from brachyd.reach import measure
from brachyd.spaces import NEXT_STEP, Box
from brachyd.steering import SCENE, NeedleSteering, Outcome, SteeringSettings
from brachyd.vector import VectorNeedleSteering

TEXT = SCENE.replace("1500", "700").replace("400", "200")
SETTINGS = SteeringSettings(text=TEXT, holes_mm=((5, 5), (-10, 0)))
FIRST = NeedleSteering(SETTINGS)  # whose model and reach the tests share


def single():
    return NeedleSteering(SETTINGS, like=FIRST)


def vector(n=4, settings=SETTINGS, **more):
    return VectorNeedleSteering(n, settings, processes=2, **more)


def end_of(pid):
    """Waits until that process, which is no child of ours, has ended; False after 10 s."""
    try:
        file = os.pidfd_open(pid)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([file], [], [], 10)[0])
    finally:
        os.close(file)


class Ticks(unittest.TestCase):
    def test_spaces_hold_what_is_given(self):
        environment = single()
        observation, info = environment.reset(seed=1)
        self.assertTrue(environment.observation_space.contains(observation))
        self.assertEqual((environment.observation_space.dtype, environment.action_space.shape), (np.float64, (2,)))
        environment.action_space.seed(3)
        for _ in range(20):
            observation, reward, terminated, truncated, info = environment.step(environment.action_space.sample())
            self.assertTrue(environment.observation_space.contains(observation))
            self.assertTrue(np.isfinite(observation).all() and np.isfinite(reward))
        self.assertEqual((terminated, truncated, info["outcome"]), (False, False, Outcome.RUNNING))
        self.assertIs(environment.unwrapped, environment)

    def test_a_box_samples_within_its_limits(self):
        box = Box(np.array([-1.0, -np.inf]), np.array([1.0, np.inf]), dtype=np.float64)
        box.seed(1)
        samples = np.array([box.sample() for _ in range(50)])
        self.assertTrue(all(box.contains(sample) for sample in samples))
        self.assertGreater(np.ptp(samples[:, 0]), 1)
        self.assertFalse(box.contains(np.array([2.0, 0.0])))
        self.assertEqual(box, Box(np.array([-1.0, -np.inf]), np.array([1.0, np.inf]), dtype=np.float64))

    def test_a_step_is_one_tick_and_moves_the_hand_by_its_speed(self):
        environment = single()
        at = environment.observation_fields
        observation, _ = environment.reset(seed=2)
        tick, bevel = environment.simulator.tick, observation[at["bevel"]]
        after, _, _, _, _ = environment.step([0.5, 1.0])
        self.assertEqual(environment.simulator.tick, tick + 1)
        self.assertAlmostEqual(after[at["hand_mm"]][0], 0.5 * 20 * 0.005)
        turned = np.arctan2(np.cross(bevel, after[at["bevel"]]), bevel @ after[at["bevel"]])
        self.assertAlmostEqual(turned, np.deg2rad(360) * 0.005)
        # Beyond ±1 nothing goes faster, and the hand does not go back behind its start.
        after, _, _, _, _ = environment.step([-7, 0])
        self.assertEqual(after[at["hand_mm"]][0], 0)

    def test_the_observation_is_the_engines_tick_and_the_way_to_the_target(self):
        environment = single()
        at = environment.observation_fields
        environment.reset(seed=2)
        for _ in range(250):
            observation, _, _, _, info = environment.step([1, 0])
        row = environment.simulator.observe()
        for name, place in environment.simulator.observation_fields.items():
            np.testing.assert_array_equal(observation[at[name]], row[place], name)
        self.assertEqual(observation[at["contact"]][0], 2)
        self.assertGreater(np.linalg.norm(observation[at["bend_mm"]]), 0.5, "the needle bends")
        to = environment.target - observation[at["tip_rest_mm"]]
        np.testing.assert_array_equal(observation[at["to_target_mm"]], to)
        self.assertAlmostEqual(info["error_mm"], np.linalg.norm(to))

    def test_rewards_add_up_to_the_way_less_the_error(self):
        environment = single()
        _, begin = environment.reset(seed=4)
        total, is_over = 0.0, False
        while not is_over:
            _, reward, terminated, truncated, info = environment.step([1, 0])
            total, is_over = total + reward, terminated or truncated
        self.assertEqual(info["outcome"], Outcome.AT_DEPTH)
        self.assertAlmostEqual(total, begin["error_mm"] - 2 * info["error_mm"])

    def test_time_truncates(self):
        environment = NeedleSteering(SteeringSettings(text=TEXT, holes_mm=SETTINGS.holes_mm, most_s=0.05), like=FIRST)
        environment.reset(seed=1)
        steps = [environment.step([0, 0])[2:4] for _ in range(10)]
        self.assertEqual(steps, [(False, False)] * 9 + [(False, True)])


class Targets(unittest.TestCase):
    def test_they_are_in_the_disc_the_tissue_and_no_organ(self):
        environment = single()
        holes = set()
        for seed in range(20):
            environment.reset(seed=seed)
            holes.add(environment.hole)
            middle, radius = environment.reach.disc(environment.hole, float(environment.target[2]))
            self.assertLessEqual(np.linalg.norm(environment.target[:2] - middle), 0.9 * radius + 1e-9)
            inside = environment.simulator.depths_of([environment.target])
            self.assertGreaterEqual(inside.pop("tissue")[0], 5)
            self.assertTrue(all(depth[0] <= -2 for depth in inside.values()))
        self.assertEqual(holes, {0, 1})

    def test_they_can_be_reached_and_a_seed_there_is_as_near(self):
        """No floor: with the hand's depth as the end, 1.4 to 2.4 mm were left that no action could take away."""
        with vector(4) as environment:
            predictive = play(environment, ModelPredictive(environment), 1, seed=7)
            straight = play(environment, StraightInsertion(environment), 1, seed=7)
            flipped = play(environment, BevelFlip(environment), 1, seed=7)
        self.assertEqual(predictive.outcome.tolist(), [Outcome.AT_DEPTH] * 4)
        self.assertLess(predictive.error_mm.max(), 0.4)
        self.assertLess(flipped.error_mm.mean(), straight.error_mm.mean())
        self.assertGreater(straight.error_mm.mean(), 0.8)
        environment = single()
        observation, _ = environment.reset(seed=7, options={"hole": 0})
        is_over = False
        while not is_over:
            observation, _, is_over, _, info = environment.step([1, 0])
        pose = np.eye(4)
        pose[:3] = environment.pose
        seed, = environment.simulator.drop(pose)
        self.assertAlmostEqual(np.linalg.norm(seed.rest - environment.target), info["error_mm"], delta=0.1)

    def test_a_hole_that_leads_through_an_organ_or_past_the_tissue_is_refused(self):
        for hole in ((0, 0), (60, 0)):
            with self.assertRaisesRegex(ValueError, rf"hole \({hole[0]}, 0\) mm"):
                measure(FIRST.simulator, [hole], 5)

    def test_an_organ_ends_an_episode(self):
        # Through the urethra, which measure() would refuse.
        environment = NeedleSteering(SteeringSettings(text=TEXT, holes_mm=((0, 0),), most_s=2), like=FIRST)
        environment.reset(seed=1, options={"target_mm": [0, 0, 100]})
        terminated = truncated = False
        while not (terminated or truncated):
            _, reward, terminated, truncated, info = environment.step([1, 0])
        self.assertEqual((terminated, truncated, info["outcome"]), (True, False, Outcome.ORGAN))
        self.assertLess(reward, -10 - info["error_mm"] + 1)


class Processes(unittest.TestCase):
    def test_many_on_processes_give_the_bits_of_single_ones(self):
        settings = SteeringSettings(text=TEXT, holes_mm=SETTINGS.holes_mm, most_s=0.9)
        chance, steps = np.random.default_rng(0), 420
        actions = chance.uniform([0.6, -1], [1, 1], (steps, 3, 2)).astype(np.float32)
        with vector(3, settings) as environment:
            self.assertEqual(environment.metadata["autoreset_mode"], NEXT_STEP)
            self.assertEqual((environment.num_envs, environment.action_space.shape), (3, (3, 2)))
            first, _ = environment.reset(seed=5)
            self.assertTrue(environment.observation_space.contains(first))
            rows = [environment.step(action) for action in actions]
        ends = 0
        for i in range(3):
            one = NeedleSteering(settings, like=FIRST)
            np.testing.assert_array_equal(one.reset(seed=5 + i)[0], first[i])
            is_over = False
            for action, (observations, rewards, terminated, truncated, info) in zip(actions, rows):
                if is_over:
                    (observation, own), reward, ended = one.reset(), 0.0, (False, False)
                else:
                    observation, reward, *ended, own = one.step(action[i])
                is_over = any(ended)
                ends += is_over
                np.testing.assert_array_equal(observations[i], observation)
                self.assertEqual((rewards[i], terminated[i], truncated[i]), (reward, *ended))
                self.assertEqual((info["error_mm"][i], info["outcome"][i]), (own["error_mm"], own["outcome"]))
        self.assertGreaterEqual(ends, 6, "episodes ended and began again")

    def test_copies_stay_and_views_follow(self):
        with vector(2) as environment:
            kept, _ = environment.reset(seed=1)
            before = kept.copy()
            environment.step(np.ones((2, 2)))
            np.testing.assert_array_equal(kept, before)
        with vector(2, copy=False) as environment:
            view, _ = environment.reset(seed=1)
            np.testing.assert_array_equal(view, before)
            environment.step(np.ones((2, 2)))
            self.assertFalse(np.array_equal(view, before))

    def test_a_process_that_dies_is_named_and_the_others_end(self):
        named = set(os.listdir("/dev/shm"))
        environment = VectorNeedleSteering(5, SETTINGS, processes=3)
        environment.reset(seed=1)
        pids = [worker.pid for worker in environment._workers]
        self.assertEqual({name for name in set(os.listdir("/dev/shm")) - named if "brachyd" in name}, set())
        os.kill(pids[0], signal.SIGKILL)
        with self.assertRaisesRegex(RuntimeError, "process 1, of environments 2 to 3, was ended by SIGKILL"):
            while True:  # the signal may come after a step
                environment.step(np.zeros((5, 2)))
        self.assertTrue(all(end_of(pid) for pid in pids))
        self.assertEqual({name for name in set(os.listdir("/dev/shm")) - named if "brachyd" in name}, set())
        with self.assertRaisesRegex(RuntimeError, "closed"):
            environment.step(np.zeros((5, 2)))
        environment.close()

    def test_processes_end_with_their_caller(self):
        program = ("import sys, brachyd.vector as v, brachyd.steering as s\n"
                   "settings = s.SteeringSettings(text=sys.argv[1], holes_mm=((5, 5),))\n"
                   "e = v.VectorNeedleSteering(3, settings, processes=3)\n"
                   "print(*[w.pid for w in e._workers], flush=True)\n"
                   "sys.stdin.read()\n")
        path = f"{ROOT / 'apps/python'}:{FOLDER}"
        with subprocess.Popen([sys.executable, "-c", program, TEXT], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              text=True, env={**os.environ, "PYTHONPATH": path}) as caller:
            pids = [int(pid) for pid in caller.stdout.readline().split()]
            self.assertEqual(len(pids), 2)
            caller.kill()
        self.assertTrue(all(end_of(pid) for pid in pids))

    def test_what_cannot_be_used_is_refused(self):
        with self.assertRaisesRegex(ValueError, "2 environments on 3 processes"):
            VectorNeedleSteering(2, SETTINGS, processes=3)
        with self.assertRaisesRegex(ValueError, "kernell"):
            VectorNeedleSteering(2, SteeringSettings(text='[model]\nkernell = "psi31"\n'))
        environment = vector(2)
        with environment:
            environment.reset(seed=1)
            for actions in (np.zeros((3, 2)), [[0, np.nan], [0, 0]], np.zeros(2)):
                with self.assertRaisesRegex(ValueError, r"actions are \(2, 2\) finite numbers"):
                    environment.step(actions)
            with self.assertRaisesRegex(ValueError, "3 seeds for 2 environments"):
                environment.reset(seed=[1, 2, 3])
            with self.assertRaisesRegex(RuntimeError, "step_wait without step_async"):
                environment.step_wait()
            with self.assertRaisesRegex(RuntimeError, "(?s)process 0, of environments 0 to 0, failed: hole 9"):
                environment.reset(options={"hole": 9})
        self.assertTrue(environment.closed)
        one = single()
        with self.assertRaisesRegex(ValueError, "no option goal"):
            one.reset(options={"goal": [0, 0, 0]})
        with self.assertRaisesRegex(ValueError, "3 finite numbers"):
            one.reset(options={"target_mm": [0, 0]})
        one.reset(seed=1)
        with self.assertRaisesRegex(ValueError, "two finite numbers"):
            one.step([np.inf, 0])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
