#!/usr/bin/env bash
# Makes the wheel, installs it with pip into a fresh virtual environment, and uses it: pictures, looks, and a type
# checker's view of it. usage: wheel_test.sh BUILD WORK PYTHON
# Exit status 77: this Python has no venv, pip or NumPy.
set -euo pipefail
build=$1 work=$2 python=$3
for each in "$python" /usr/bin/python3; do
    if "$each" -c 'import numpy, venv, ensurepip' 2>/dev/null; then found=$each; break; fi
done
[ -n "${found:-}" ] || { echo "no Python with venv and NumPy"; exit 77; }
here=$(realpath "$(dirname "$0")")
rm -rf "$work"
mkdir -p "$work"
cmake --build "$build" --target wheel >"$work/wheel.log" 2>&1 || { cat "$work/wheel.log"; exit 1; }
wheel=$(tail -n 20 "$work/wheel.log" | grep -o '/.*\.whl' | tail -n 1)
cp "$wheel" "$work/first.whl"

# The same content gives the same bytes.
cmake --build "$build" --target wheel >>"$work/wheel.log" 2>&1
cmp "$wheel" "$work/first.whl"

# NumPy is the machine's: nothing is downloaded.
"$found" -m venv --system-site-packages "$work/venv"
cd "$work"
venv/bin/python -m pip install --no-index --disable-pip-version-check "$wheel" >pip.log 2>&1 || { cat pip.log; exit 1; }
unset PYTHONPATH LD_LIBRARY_PATH
cp "$here/octahedron.off" .
cat >use.py <<'PYTHON'
import ast
import inspect
import pathlib

import numpy as np
import vcp

assert "venv" in vcp.__file__, vcp.__file__
vcp.build(["octahedron.off"], "tree.vcp", cell=0.05, colour="none", format="off")
told = []
with vcp.open("tree.vcp", width=160, height=120, progress=lambda opened, datasets: told.append((opened, datasets))) as view:
    assert view.settle()
    plain, depth = view.render()

    # Looks: what is set is what is got.
    assert view.look["shading"] == "lit" and view.look["samples"] == 16
    assert not view.look["plain"] and view.look["colour_error"] == 6
    view.set_look(plain=True, colour_error=5)
    assert view.look["plain"] and view.look["colour_error"] == 5 and not view.stats["colour_limits"]
    view.set_look(plain=False, colour_error=6)
    view.set_look(shading="normals", transparent=True)
    assert view.look["shading"] == "normals" and view.look["transparent"]
    view.settle()
    normals, _ = view.render()
    assert not np.array_equal(normals[..., :3], plain[..., :3]) and normals[0, 0, 3] == 0
    view.set_look(shading="lit", transparent=False)
    view.set_light((1, 0, 0), in_world=True)
    assert view.look["light"] == [1, 0, 0] and view.look["light_in_world"]
    view.settle()
    assert not np.array_equal(view.render()[0], plain)

    # Half of it is cut away.
    hit = view.stats["hit_pixels"]
    view.set_sections([(0, 1, 0, 0.4)], caps=True)
    view.settle()
    assert view.look["section_caps"] and view.stats["hit_pixels"] < hit
    view.set_sections([])

    # A drag turns it, a wheel comes nearer.
    before = view.camera["position"]
    view.press(vcp.LEFT_BUTTON, 80, 60)
    view.move(120, 60)
    view.release(vcp.LEFT_BUTTON)
    view.scroll(80, 60, 2)
    view.settle()
    assert view.camera["position"] != before
    view.key("F")

    # A line over the picture, and the picture in a file.
    view.set_lines([([(-2, 0, 0), (2, 0, 0)], (1, 0, 0, 1), 3)])
    view.settle()
    assert (view.render()[0][..., :3] == (255, 0, 0)).all(axis=-1).sum() > 50
    view.save_png("picture.png")
    assert open("picture.png", "rb").read(8) == b"\x89PNG\r\n\x1a\n"
    view.set_visible(0, False)
    view.set_lines([])
    view.settle()
    assert view.stats["hit_pixels"] == 0 and not view.is_visible(0)
    for wrong in (lambda: view.set_look(colour=1), lambda: view.set_look(shading="pink"), lambda: view.set_visible(1, True)):
        try:
            wrong()
        except (TypeError, ValueError, vcp.Error):
            continue
        raise AssertionError("a wrong call was taken")

# Closed, it says so.
for use in (lambda: view.settle(), lambda: view.dataset, lambda: view.camera):
    try:
        use()
        raise AssertionError("a closed view was used")
    except vcp.Error:
        pass
try:
    vcp.open("tree.vcp", progress=lambda opened, datasets: False)
except vcp.Error as error:
    print("cancelled:", error)

# The stubs name what there is, and nothing else.
stub = ast.parse((pathlib.Path(vcp.__file__).parent / "__init__.pyi").read_text())
top = {each.name for each in stub.body if isinstance(each, (ast.FunctionDef, ast.ClassDef))}
top |= {each.target.id for each in stub.body if isinstance(each, ast.AnnAssign)}
assert set(vcp.__all__) <= top, set(vcp.__all__) - top
body = next(each for each in stub.body if isinstance(each, ast.ClassDef) and each.name == "View").body
stubbed = {each.name for each in body if isinstance(each, ast.FunctionDef)} | {each.target.id for each in body if isinstance(each, ast.AnnAssign)}
real = {name for name, _ in inspect.getmembers(vcp.View) if not name.startswith("_")} | {"__enter__", "__exit__"}
assert stubbed == real, stubbed ^ real
PYTHON
venv/bin/python use.py
venv/bin/python -m pip uninstall --yes vcp >pip.log 2>&1 || { cat pip.log; exit 1; }
if venv/bin/python -c 'import vcp' 2>/dev/null; then echo "vcp is still there"; exit 1; fi
