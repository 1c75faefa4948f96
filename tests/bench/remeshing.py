#!/usr/bin/env python3
"""Makes the tables of docs/remeshing.md, "Against marching": tests/bench/remeshing.py BUILD DATA [FOLDER].

BUILD holds vcp and tests/remesh_error, DATA the folders scans and terrain. Four assets in maps of 1,024 texels, five
views of each at 1920 x 1200. A frame's time is processor time of all threads: that of a run through the views twice
less that of a run through them once, a fifth of it, so that neither start nor what a first view measures is in it.
Errors of remeshed surfaces are those of tests/support/remesh_errors.h, over the same views.
"""
import json
import math
import resource
import shutil
import subprocess
import sys
from pathlib import Path

VIEWS = [(20, 35, 2.6), (95, 25, 2.0), (200, 40, 3.0), (300, 15, 2.0), (0, 80, 2.2)]  # azimuth, elevation, distance
METHODS = [
    ("remesh, 0.5 px", {"method": "remesh", "error": 0.5}),
    ("remesh, 1 px", {"method": "remesh", "error": 1}),
    ("boxes", {"method": "boxes"}),
    ("pyramid", {"method": "pyramid"}),
    ("relief, 256 steps", {"method": "relief-illinois", "steps": 256}),
]


def run(*command):
    """Runs a command; returns its standard output and the seconds that its processors took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE)
    return done.stdout, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def write_cylinder(path):
    """32 triangles about the bust's head, y up; the map goes once around."""
    sides, (x, z), radius, ends = 16, (0.045, -0.005), 0.15, (0.82, 1.14)
    with open(path, "w") as out:
        for y in ends:
            for i in range(sides):
                turn = 2 * math.pi * i / sides
                out.write(f"v {x + radius * math.sin(turn)} {y} {z + radius * math.cos(turn)}\n")
        for v in range(2):
            for i in range(sides + 1):
                out.write(f"vt {i / sides} {v}\n")
        for i in range(1, sides + 1):
            after, up, over = i % sides + 1, sides, sides + 1
            out.write(f"f {i}/{i} {after}/{i + 1} {after + up}/{i + 1 + over}\n")
            out.write(f"f {i}/{i} {after + up}/{i + 1 + over} {i + up}/{i + over}\n")


def write_ground(path):
    """Two triangles below the mountains."""
    corners = [(376400, 3788800), (412100, 3788800), (412100, 3807700), (376400, 3807700)]
    with open(path, "w") as out:
        out.writelines(f"v {x} {y} 315\n" for x, y in corners)
        out.write("vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")


def bake(vcp, folder, name, mesh, *options):
    shutil.rmtree(folder / name, ignore_errors=True)
    run(vcp, "build", mesh, "-o", folder / f"{name}.vcp", "--overwrite", "--progress", "none")
    run(vcp, "meso", "bake", folder / f"{name}.vcp", "-o", folder / name, "--texels", 1024, "--progress", "none",
        *options)
    return json.loads((folder / name / "scene.json").read_text())["mesostructure"][0]


def write_cameras(path, rounds, centre, size, up):
    cameras = []
    for azimuth, elevation, distance in VIEWS:
        a, e = math.radians(azimuth), math.radians(elevation)
        aside = (math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e))
        if up == "y":
            aside = (aside[0], aside[2], -aside[1])
        cameras.append({"position": [c + distance * size * d for c, d in zip(centre, aside)], "target": centre,
                        "up_axis": up})
    path.write_text(json.dumps(rounds * cameras))


def measure(build, folder, name, surface, look):
    for method, keys in METHODS:
        described = {key: value for key, value in surface.items() if key != "method"}
        if not method.startswith("remesh"):
            described.pop("filter", None)
            described["far"] = False
        scene = folder / name / f"{''.join(filter(str.isalnum, method.removesuffix(' px')))}.json"
        scene.write_text(json.dumps({"mesostructure": [described | keys]}))
        seconds = []
        for rounds in (2, 1):
            cameras = folder / name / "cameras.json"
            write_cameras(cameras, rounds, *look)
            _, took = run(build / "vcp", "render", scene, "-o", folder / name / "picture.png", "--overwrite",
                            "--size", "1920x1200", "--samples", 1, "--device", "llvmpipe", "--path", cameras,
                            "--frames", rounds * len(VIEWS), "--progress", "none", "--json")
            seconds.append(took)
        frame = 1e3 * (seconds[0] - seconds[1]) / len(VIEWS)
        print(f"| {name} | {method} | {frame:,.0f} | {seconds[1]:.1f} |{errors(build, scene, cameras, keys)}",
              flush=True)


def errors(build, scene, cameras, keys):
    """Returns the columns of what a remeshed surface is off; nothing of a marched one."""
    if "error" not in keys:
        return ""
    out, _ = run(build / "tests/remesh_error", scene, cameras, keys["error"])
    told = json.loads(out)
    return (f" {told['vertices']:,} | {told['p50']:.3f} | {told['p95']:.3f} | {told['p999']:.2f} | {told['max']:.2f} |"
            f" {told['certified_pixels']:.2f} | {told['uncertified_patches']:.1f} |")


def main():
    build, data = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    folder = Path(sys.argv[3] if len(sys.argv) > 3 else "remeshing").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    vcp = build / "vcp"
    write_cylinder(folder / "cylinder.obj")
    write_ground(folder / "ground.obj")
    (folder / "sphere").mkdir(exist_ok=True)
    run(vcp, "meso", "build", "fbm", "--texels", 1024, "--only-heights", "-o", folder / "sphere" / "fbm.meso",
        "--overwrite")
    assets = [
        ("head", bake(vcp, folder, "head", data / "scans/threedscans/Gutenberg/Gutenberg.obj", "--base",
                      folder / "cylinder.obj", "--reach", 0.14), ([0.045, 0.98, -0.005], 0.25, "y")),
        ("mountains", bake(vcp, folder, "mountains", data / "terrain/bigtujunga_utm11n_double.ply", "--base",
                           folder / "ground.obj", "--reach", 2100), ([394250, 3798250, 1000], 16000, "z")),
        ("sphere", {"asset": "fbm.meso", "surface": "sphere", "tiles": 4}, ([0, 0, 0], 1.0, "z")),
        ("bunny", bake(vcp, folder, "bunny", data / "scans/bun_zipper_ascii.ply", "--triangles", 5000),
         ([-0.017, 0.11, -0.0015], 0.08, "y")),
    ]
    print("| surface | method | ms a frame | first round, s | vertices a view | error p50 | p95 | p99.9 | max px |"
          " certified px | uncertified patches |")
    print("|---" * 11 + "|")
    for name, surface, look in assets:
        measure(build, folder, name, surface, look)


if __name__ == "__main__":
    main()
