"""Runs commonroad-drivability-checker (batch, box2d) on a workload file and compares it with our figures.

usage: compare.py WORKLOAD.bin OURS.txt     (OURS.txt is what `first_collision run WORKLOAD.bin` printed)
"""

import struct
import sys
import time

import numpy as np
from commonroad_dc import pycrcc
from commonroad_dc.collision.trajectory_queries import trajectory_queries

ROUNDS = 15


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    n, steps, m = struct.unpack_from("<3I", data)
    numbers = np.frombuffer(data, dtype="<f8", offset=12)
    size, numbers = numbers[:2], numbers[2:]
    candidates, numbers = numbers[: n * steps * 3].reshape(n, steps, 3), numbers[n * steps * 3 :]
    objects, numbers = numbers[: m * steps * 3].reshape(m, steps, 3), numbers[m * steps * 3 :]
    return size, candidates, objects, numbers.reshape(m, 2)


def build_candidates(size, candidates):
    n, steps, _ = candidates.shape
    starts = np.zeros(n, dtype=np.int32)
    rows = np.ascontiguousarray(candidates.reshape(n, steps * 3))
    return pycrcc.OBBTrajectoryBatch(rows, starts, size[0] / 2, size[1] / 2).to_tvobstacle()


def build_objects(objects, sizes):
    built = []
    for poses, (length, width) in zip(objects, sizes):
        moving = pycrcc.TimeVariantCollisionObject(0)
        for x, y, yaw in poses:
            moving.append_obstacle(pycrcc.RectOBB(length / 2, width / 2, yaw, x, y))
        built.append(moving)
    return built


def query(candidates, objects):
    return trajectory_queries.trajectories_collision_dynamic_obstacles(candidates, objects, method="box2d")


def best(run):
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times) * 1e3


def main():
    path, ours_path = sys.argv[1:]
    size, candidates, objects, sizes = read(path)
    ready, moving = build_candidates(size, candidates), build_objects(objects, sizes)
    theirs = np.array(list(query(ready, moving)))
    ours = np.fromfile(path.replace(".bin", ".first"), dtype="<i4")
    agree = int((theirs == ours).sum())
    peer_ready = best(lambda: query(ready, moving))
    peer_whole = best(lambda: query(build_candidates(size, candidates), build_objects(objects, sizes)))
    print(f"{path}: first hits agree on {agree} of {len(ours)}; {(ours >= 0).sum()} collide")
    print(f"  peer, 1 thread: {peer_ready:.3f} ms prebuilt, {peer_whole:.3f} ms end to end")
    for line in open(ours_path, encoding="utf-8"):
        if line.startswith("decoded"):
            decoded_ms = float(line.split()[1])
            print(f"  ours, from messages: {decoded_ms:.3f} ms; {peer_whole / decoded_ms:.1f} times as fast")
            continue
        _, threads, ready_ms, whole_ms = line.split()
        per_second = len(ours) / float(ready_ms)
        print(
            f"  ours, {threads} thread(s): {float(ready_ms):.3f} ms prebuilt ({per_second:.0f} k/s), "
            f"{float(whole_ms):.3f} ms end to end; "
            f"{peer_ready / float(ready_ms):.1f} and {peer_whole / float(whole_ms):.1f} times as fast"
        )
    return 0 if agree == len(ours) else 1


if __name__ == "__main__":
    sys.exit(main())
