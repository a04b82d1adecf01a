"""Times Frenetix (C++ core, PyPI) while it checks candidates for what a vehicle can do, beside our filter for the same.

usage: compare.py OURS.txt     (OURS.txt is what `cargo bench --bench filters` printed)

Frenetix checks trajectories that it makes itself, so the candidates are not the same ones, only as many points long:
80, 0.1 s apart. Its rules are its own as well: acceleration, curvature, curvature rate, yaw rate (that for speed is empty
in version 0.4.0). What is compared is the price of a candidate, with every rule looking at the whole of it. The checks find
curvatures and headings ready that were computed with the points; ours compute what they need from the message.
"""

import statistics
import sys
import time

import frenetix
import numpy as np
from frenetix.trajectory_functions import FillCoordinates
from frenetix.trajectory_functions import feasability_functions as checks

ROUNDS = 25
POINTS = 80
STEP_S = 0.1
WHEEL_BASE_M = 2.79
MAX_STEER_RAD = 0.70
SPEED_MPS = 10.0


def sampling_matrix():
    """64 ways to go on from 10 m/s: eight speeds and eight lateral places to end with."""
    end_s = (POINTS - 1) * STEP_S
    rows = [
        [0.0, end_s, 20.0, SPEED_MPS, 0.0, speed, 0.0, 0.0, 0.0, 0.0, aside, 0.0, 0.0]
        for speed in np.linspace(0.0, 20.0, 8)
        for aside in np.linspace(-40.0, 40.0, 8)
    ]
    return np.array(rows)


def handler(with_checks):
    made = frenetix.TrajectoryHandler(dt=STEP_S)
    turn = np.linspace(0.0, 1.0, 400)
    road = np.column_stack((200.0 * np.sin(turn), 200.0 * (1.0 - np.cos(turn))))
    made.add_function(FillCoordinates(False, 0.0, frenetix.CoordinateSystemWrapper(road), (POINTS - 1) * STEP_S))
    if with_checks:
        made.add_feasability_function(checks.CheckAccelerationConstraint(20.0, 8.0, True))
        made.add_feasability_function(checks.CheckCurvatureConstraint(MAX_STEER_RAD, WHEEL_BASE_M, True))
        made.add_feasability_function(checks.CheckCurvatureRateConstraint(WHEEL_BASE_M, 0.4, True))
        made.add_feasability_function(checks.CheckYawRateConstraint(MAX_STEER_RAD, WHEEL_BASE_M, True))
    return made


def microseconds_per_candidate(with_checks, matrix):
    spent = []
    for _ in range(ROUNDS):
        made = handler(with_checks)
        made.generate_trajectories(matrix, False)
        start = time.perf_counter()
        made.evaluate_all_current_functions(True)
        spent.append(time.perf_counter() - start)
    found = made.get_feasible_count(), made.get_infeasible_count()
    if sum(found) != len(matrix):
        raise SystemExit("Frenetix judged %d of %d candidates" % (sum(found), len(matrix)))
    return statistics.median(spent) / len(matrix) * 1e6, found


def ours(path):
    """Largest time for a candidate over all scenes, of the two checks that answer the same question."""
    times = {}
    for line in open(path, encoding="utf-8"):
        words = line.split()
        if len(words) == 5 and words[1] in ("data_validity", "vehicle_constraint_filter"):
            times.setdefault(words[0], []).append(float(words[4]))
    both = [sum(pair) for pair in times.values() if len(pair) == 2]
    if not both:
        raise SystemExit("%s holds no times of our filters" % path)
    return max(both)


def main():
    matrix = sampling_matrix()
    placed, _ = microseconds_per_candidate(False, matrix)
    whole, (feasible, infeasible) = microseconds_per_candidate(True, matrix)
    our_us = ours(sys.argv[1])
    print("frenetix: %d candidates of %d points, %d feasible, %d not" % (len(matrix), POINTS, feasible, infeasible))
    print("  peer: %.2f us for a candidate, of which its checks take %.2f" % (whole, whole - placed))
    print("  ours: %.2f us for a candidate, data check and vehicle constraints, slowest scene" % our_us)


if __name__ == "__main__":
    main()
