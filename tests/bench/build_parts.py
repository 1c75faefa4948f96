#!/usr/bin/env python3
"""Measures what a build in parts costs: processor time against one build, and the longest part of each stage.

usage: build_parts.py VCP MESH FOLDER [--parts 1,3,8] [--memory M] [--repeat N] [--simulate TRIANGLES:P,P]...
MESH may be a folder of meshes, tiles of one scan: then reading is shared out as well.

Everything runs with one thread, one process after the other, so that the processor time of a part is what it would
take on a machine of its own; the least of all repetitions counts. The files must be the same, byte for byte.

--simulate foretells a larger build from the stages that were measured. It assumes:
  - all stages but merge take the processor time a triangle that they took here; the parts of a stage differ as the
    parts of the largest P differed here (drawn from these, the same draw each time), but for those of read and deal:
    of many tiles each has about as much;
  - merge takes a time for each triangle and one for each boundary between parts on each level, of which there is one
    more for four times the triangles;
  - a part runs on a machine of its own with --processors, of which it makes use of three quarters;
  - a process reads and writes 1 GB/s, all together 20 GB/s; a stage takes the longer of processors and disks.
"""
import argparse
import filecmp
import math
import os
import random
import shutil

PROCESSORS_USED = 0.75
PROCESS_BYTES, ALL_BYTES = 1e9, 20e9  # a second
# Bytes a triangle that a stage reads and writes: the input, the soup (written, read three times, read), bins, pages.
STAGE_BYTES = {
    "plan": 19,
    "read": 19 + 18,
    "count": 3 * 18,
    "deal": 18 + 22,
    "vertices": 22 + 29,
    "pages": 29 + 2 * 22 + 4,
    "merge": 4 + 4,
}


def run(*words):
    """Returns the seconds of processor time of a program."""
    null = [(os.POSIX_SPAWN_OPEN, 1, "/dev/null", os.O_WRONLY, 0)]
    child = os.posix_spawn(words[0], words, os.environ, file_actions=null)
    _, status, used = os.wait4(child, 0)
    if status != 0:
        raise SystemExit(f"failed: {' '.join(words)}")
    return used.ru_utime + used.ru_stime


def measured_build(options, output):
    words = [options.vcp, "build", options.mesh, "-o", output, "--threads", "1", "--progress", "none"]
    return min(run(*words, *options.memory_words) for _ in range(options.repeat))


def measured_parts(options, output, parts):
    """Returns the seconds of each part, by stage."""
    best = {}
    for _ in range(options.repeat):
        plan = output + ".parts"
        shutil.rmtree(plan, ignore_errors=True)
        words = ["build-plan", options.mesh, "-o", output, "--parts", str(parts), *options.memory_words]
        seconds = {"plan": [run(options.vcp, *words)]}
        for stage in list(STAGE_BYTES)[1:]:
            count = 1 if stage in ("count", "merge") else parts
            words = [options.vcp, "build-step", stage]
            rest = ["--plan", plan, "--threads", "1", "--progress", "none"]
            seconds[stage] = [run(*words, str(number), *rest) for number in range(count)]
        for stage, these in seconds.items():
            best[stage] = [min(pair) for pair in zip(these, best.get(stage, these))]
        shutil.rmtree(plan)
    return best


def simulated(seconds, parts, fewest, triangles, wanted, processors, by):
    """Returns the hours of each stage. `seconds`: of `parts` parts; `fewest`: of one."""
    chosen = random.Random(1)
    hours = {}
    boundary = (seconds["merge"][0] - fewest["merge"][0]) / max(parts - 1, 1)
    levels = max(math.log(triangles, 4) - 6, 1)
    for stage in STAGE_BYTES:
        count = 1 if stage in ("plan", "count", "merge") else by
        mean = sum(seconds[stage]) / len(seconds[stage])
        slowest = max(chosen.choice(seconds[stage]) / mean for _ in range(count)) if stage in ("vertices", "pages") else 1
        work = sum(seconds[stage]) * wanted / triangles / count * slowest
        if stage == "merge":
            more = (levels + math.log(wanted / triangles, 4)) / levels
            work = fewest["merge"][0] * wanted / triangles + boundary * (by - 1) * more
        computing = work / (processors * PROCESSORS_USED)
        disk = STAGE_BYTES[stage] * wanted / min(PROCESS_BYTES * count, ALL_BYTES)
        hours[stage] = max(computing, disk) / 3600
    return hours


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("vcp")
    parser.add_argument("mesh")
    parser.add_argument("folder")
    parser.add_argument("--parts", default="1,3,8")
    parser.add_argument("--memory")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--triangles", type=float, help="of the mesh, for --simulate")
    parser.add_argument("--processors", type=int, default=16)
    parser.add_argument("--simulate", action="append", default=[])
    options = parser.parse_args()
    options.memory_words = ["--memory", options.memory] if options.memory else []
    os.makedirs(options.folder, exist_ok=True)
    whole, output = (os.path.join(options.folder, name) for name in ("whole.vcp", "parts.vcp"))
    build = measured_build(options, whole)
    print(f"one build: {build:.2f} s", flush=True)
    by_parts = {}
    for parts in map(int, options.parts.split(",")):
        seconds = by_parts[parts] = measured_parts(options, output, parts)
        if not filecmp.cmp(whole, output, shallow=False):
            raise SystemExit(f"{parts} parts: other bytes than one build")
        total = sum(map(sum, seconds.values()))
        path = sum(map(max, seconds.values()))
        print(f"{parts} parts: {total:.2f} s ({100 * (total / build - 1):+.1f} %), critical path {path:.2f} s")
        for stage, these in seconds.items():
            print(f"  {stage:9} {sum(these):7.2f} s, longest {max(these):.2f} s", flush=True)
    fewest, most = min(by_parts), max(by_parts)
    for words in options.simulate:
        wanted, counts = words.split(":")
        for by in map(int, counts.split(",")):
            hours = simulated(by_parts[most], most, by_parts[fewest], options.triangles, float(wanted),
                              options.processors, by)
            stages = ", ".join(f"{stage} {each:.2f}" for stage, each in hours.items())
            print(f"{float(wanted):.0e} triangles in {by} parts: {sum(hours.values()):.2f} h ({stages})")


main()
