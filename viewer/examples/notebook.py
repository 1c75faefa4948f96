#!/usr/bin/env python3
"""From a mesh to pictures in NumPy, cell by cell: notebook.py MESH_OR_VCP [FOLDER]"""
# %% Find the module: installed, or PYTHONPATH=build/release/python
import pathlib
import sys

import numpy as np
import vcp

source = pathlib.Path(sys.argv[1])
folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ".")

# %% Build, unless it is built already
tree = source
if source.suffix != ".vcp":
    tree = folder / (source.stem + ".vcp")
    told = []
    report = vcp.build([str(source)], str(tree), progress=lambda stage, fraction: told.append(fraction))
    print(f"{report['triangles']} triangles in {report['file_bytes']} bytes, told of progress: {told == sorted(told) and len(told) > 0}")

# %% Open, settle, and look
view = vcp.open(str(tree), width=320, height=240)
view.settle()
rgba, depth = view.render()
hit = np.isfinite(depth)
print(f"{rgba.shape} {rgba.dtype}, {depth.shape} {depth.dtype}: {hit.sum()} pixels show the surface")
assert hit.sum() == view.stats["hit_pixels"]

# %% Pick where the surface is nearest: in double precision, whatever is drawn
y, x = np.unravel_index(np.argmin(np.where(hit, depth, np.inf)), depth.shape)
picked = view.pick(x + 0.5, y + 0.5)
print(f"nearest: {picked['position']}, within {picked['error']:.2g}")
assert np.isclose(picked["distance"], depth[y, x], rtol=1e-3)

# %% Another camera, another picture
view.act(vcp.ISOMETRIC)
view.settle()
other, _ = view.render()
assert not np.array_equal(other, rgba)
camera = view.camera
view.set_camera(position=(2 * np.array(camera["position"]) - camera["target"]).tolist())
view.settle()
assert view.stats["hit_pixels"] < hit.sum()

# %% Wrong calls are exceptions
try:
    vcp.open("/nowhere.vcp")
except vcp.Error as error:
    print(f"as it should be: {error}")
