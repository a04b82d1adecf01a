"""Times lanelet2's readers and ours on the same files; started by run.sh.

The stock reader knows no traffic rules of Autoware and throws on them, so the map is first stripped of
regulatory elements that lanelet2 itself does not have. The .bin file is written by lanelet2 from the stripped map.
A second pair of files holds several copies of the map side by side, as large as a city.
"""
import argparse
import json
import os
import statistics
import subprocess
import time
import xml.etree.ElementTree as ElementTree

import lanelet2
from lanelet2.io import Origin
from lanelet2.projection import UtmProjector

KNOWN_RULES = {"traffic_light", "right_of_way", "speed_limit", "traffic_sign", "all_way_stop"}


def tag(element, key):
    return next((t.get("v") for t in element.findall("tag") if t.get("k") == key), None)


def stripped(path):
    """The map without rules the stock reader throws on; ways that only they used stay."""
    root = ElementTree.parse(path).getroot()
    unknown = {
        r.get("id")
        for r in root.findall("relation")
        if tag(r, "type") == "regulatory_element" and tag(r, "subtype") not in KNOWN_RULES
    }
    for relation in root.findall("relation"):
        if relation.get("id") in unknown:
            root.remove(relation)
            continue
        for member in relation.findall("member"):
            if member.get("type") == "relation" and member.get("ref") in unknown:
                relation.remove(member)
    return root, len(unknown)


def repeated(root, copies):
    """Copies of the map, each with ids of its own and a little further north."""
    city = ElementTree.Element(root.tag, root.attrib)
    for copy in range(copies):
        for element in root:
            if element.tag not in ("node", "way", "relation"):
                continue
            twin = ElementTree.fromstring(ElementTree.tostring(element))
            for part in [twin, *twin.findall("nd"), *twin.findall("member")]:
                for key in ("id", "ref"):
                    if part.get(key) is not None:
                        part.set(key, str(int(part.get(key)) + copy * 10_000_000_000))
            if element.tag == "node":
                twin.set("lat", repr(float(twin.get("lat")) + 0.02 * copy))
            city.append(twin)
    # The readers expect nodes before ways before relations no more than we do, but tools write them so.
    city[:] = sorted(city, key=lambda e: ("node", "way", "relation").index(e.tag))
    return city


def origin_of(root):
    node = root.find("node")
    return float(node.get("lat")), float(node.get("lon"))


def time_theirs(path, projector, runs):
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        loaded = lanelet2.io.load(path, projector)
        seconds.append(time.perf_counter() - start)
        counts = (len(loaded.pointLayer), len(loaded.laneletLayer), len(loaded.regulatoryElementLayer))
        del loaded
    return statistics.median(seconds), min(seconds), counts


def time_ours(program, path, origin, runs):
    command = [program, "--runs", str(runs), "--utm", "%r,%r" % origin, path]
    answer = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    counts = (answer["points"], answer["lanelets"], answer["regulatory_elements"])
    return answer["median_s"], answer["min_s"], counts


def check_writing(program, osm, archive, projector):
    """lanelet2 must be able to read what we write."""
    subprocess.run([program, osm, archive], check=True)
    loaded, original = lanelet2.io.load(archive, projector), lanelet2.io.load(osm, projector)
    for layer in ("pointLayer", "lineStringLayer", "polygonLayer", "laneletLayer", "regulatoryElementLayer"):
        ours, theirs = (sorted(e.id for e in getattr(m, layer)) for m in (loaded, original))
        if ours != theirs:
            raise SystemExit("%s: lanelet2 reads another %s from our archive" % (archive, layer))
    for lanelet in original.laneletLayer:
        twin = loaded.laneletLayer[lanelet.id]
        for side in ("leftBound", "rightBound"):
            if [p.id for p in getattr(twin, side)] != [p.id for p in getattr(lanelet, side)]:
                raise SystemExit("%s: lanelet %d has another %s" % (archive, lanelet.id, side))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--ours", required=True)
    parser.add_argument("--writer", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--copies", type=int, default=16)
    parser.add_argument("map")
    options = parser.parse_args()
    os.makedirs(options.work, exist_ok=True)

    root, removed = stripped(options.map)
    origin = origin_of(root)
    projector = UtmProjector(Origin(*origin))
    name = os.path.splitext(os.path.basename(options.map))[0]
    files = []
    for label, tree in ((name, root), ("%s-x%d" % (name, options.copies), repeated(root, options.copies))):
        osm, archive = (os.path.join(options.work, label + end) for end in (".osm", ".bin"))
        ElementTree.ElementTree(tree).write(osm, encoding="UTF-8", xml_declaration=True)
        lanelet2.io.write(archive, lanelet2.io.load(osm, projector), projector)
        files += [archive, osm]
        check_writing(options.writer, osm, os.path.join(options.work, "ours.bin"), projector)

    print("lanelet2 reads the same elements from archives written by us")
    print("lanelet2 %s (PyPI wheel), %d rules unknown to it left out, median of %d runs, %d CPUs"
          % ("1.2.3", removed, options.runs, os.cpu_count()))
    print("%-32s %9s %10s %9s %12s %11s %7s" % ("file", "MB", "points", "lanelets", "lanelet2 [s]", "ours [s]", "ratio"))
    for path in files:
        their_median, _, their_counts = time_theirs(path, projector, options.runs)
        our_median, _, our_counts = time_ours(options.ours, path, origin, options.runs)
        if their_counts != our_counts:
            raise SystemExit("%s: lanelet2 has %s, we have %s" % (path, their_counts, our_counts))
        print("%-32s %9.2f %10d %9d %12.4f %11.4f %7.1f" % (
            os.path.basename(path), os.path.getsize(path) / 1e6, *our_counts[:2], their_median, our_median,
            their_median / our_median))


if __name__ == "__main__":
    main()
