"""Tests of figures.py: costs read off measured points. Run: python3 figures_test.py"""

import math
import os
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import figures


def point(program, cpu_s, relmse, **setting):
    setting = setting or {"samples": 2}
    return {"program": program, "cpu_s": cpu_s, "relmse": relmse, "setting": setting}


def curve(program, constant, power, costs):
    """relMSE = constant * cost^power, a straight line in log-log."""
    return [point(program, cost, constant * cost**power) for cost in costs]


class CostOf(unittest.TestCase):
    def test_a_power_law_is_read_exactly(self):
        points = curve("a", 1.0, -1.5, (1.0, 10.0, 1000.0))
        for target in (1e-1, 1e-2, 1e-4):
            cost, mark = figures.cost_of(points, target)
            self.assertAlmostEqual(cost, target ** (-1 / 1.5), delta=1e-9 * cost)
            self.assertEqual(mark, "")

    def test_beyond_the_last_point_it_goes_on_along_the_slope_and_says_so(self):
        cost, mark = figures.cost_of(curve("a", 1.0, -2.0, (1.0, 5.0)), 1e-4)
        self.assertAlmostEqual(cost, 100.0, delta=1e-9)
        self.assertEqual(mark, "~")

    def test_below_the_first_point_it_is_a_bound(self):
        self.assertEqual(figures.cost_of(curve("a", 1e-3, -1.0, (1.0, 2.0)), 1e-2), (1.0, "<"))

    def test_where_the_error_no_longer_falls_there_is_no_cost(self):
        points = [point("a", 1.0, 1.0e-3), point("a", 4.0, 0.9e-3)]
        self.assertEqual(figures.cost_of(points, 1e-4), (None, ""))

    def test_a_dearer_and_worse_point_does_not_count(self):
        points = curve("a", 1.0, -1.0, (1.0, 10.0, 100.0)) + [point("a", 20.0, 0.5)]
        self.assertAlmostEqual(figures.cost_of(points, 0.02)[0], 50.0, delta=1e-7)


class Discs(unittest.TestCase):
    # The error's square falls as 1/cost, and the reference's own is taken off.
    def test_cost_goes_with_the_inverse_square_of_the_discs_error(self):
        noise = 1e-3
        points = [
            {**point("Cycles", cost, 1.0), "disc_rms": math.hypot(0.1 / math.sqrt(cost), noise),
             "disc_rms_of_reference": noise}
            for cost in (1.0, 10.0, 1000.0)
        ]
        cost, mark = figures.cost_of(figures.by_discs(points), 1e-2**2)
        self.assertAlmostEqual(cost, 100.0, delta=1e-6)
        self.assertEqual(mark, "")
        self.assertEqual(figures.by_discs([point("Cycles", 1.0, 1.0)]), [])


class Ratios(unittest.TestCase):
    def setUp(self):
        # fstop: 1 s at one sample and 1 s more for each 10^-3 / relMSE; Cycles thrice that.
        self.points = [point("fstop", 1.0, 0.1, samples=1), point("Cycles", 2.0, 0.1, samples=1)]
        for relmse in (1e-1, 1e-2, 1e-3, 1e-4):
            self.points.append(point("fstop", 1.0 + 1e-3 / relmse, relmse, max_error=relmse))
            samples = round(1 / relmse)
            self.points.append(point("Cycles", 2.0 + 3e-3 / relmse, relmse, samples=samples))

    def test_net_of_each_programs_own_start(self):
        for ratio in figures.ratios(self.points, "Cycles"):
            self.assertAlmostEqual(ratio["net"], 3.0, delta=1e-9)
            ours = 1e-3 / ratio["target"]
            self.assertAlmostEqual(ratio["gross"], (2 + 3 * ours) / (1 + ours), delta=1e-9)

    def test_adaptive_points_stay_off_the_curve(self):
        self.points.append(point("Cycles", 0.1, 1e-5, samples=64, adaptive=0.01))
        self.assertAlmostEqual(figures.ratios(self.points, "Cycles")[1]["net"], 3.0, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
