#!/usr/bin/env python3
"""Makes a wheel of the installed package `vcp` of Python and its library, with nothing but Python itself.

usage: make_wheel.py PREFIX VERSION LICENCE FOLDER

PREFIX: where the components python and library were installed. The wheel is for this Python and this machine's
libraries (linux_x86_64, not manylinux), and needs NumPy. Its bytes depend on its content alone.
"""
import base64
import hashlib
import pathlib
import sys
import sysconfig
import zipfile

METADATA = """Metadata-Version: 2.1
Name: vcp
Version: {version}
Summary: Views of massive scans: .vcp files in NumPy
License: MIT
Requires-Python: >={python}, <{next}
Requires-Dist: numpy
"""
WHEEL = """Wheel-Version: 1.0
Generator: vcp
Root-Is-Purelib: false
Tag: {tag}
"""


def main():
    prefix, version, licence, folder = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
    major, minor = sys.version_info[:2]
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tag = f"cp{major}{minor}-cp{major}{minor}-{platform}"
    info = f"vcp-{version}.dist-info"
    package = prefix / "lib/python3/dist-packages/vcp"
    files = {f"vcp/{path.name}": path.read_bytes() for path in package.iterdir() if path.is_file()}
    # The module looks for the library beside itself, by its SONAME.
    library = next(path for path in prefix.rglob("libvcp.so.*") if path.is_symlink())
    files[f"vcp/{library.name}"] = library.read_bytes()
    files[f"{info}/METADATA"] = METADATA.format(version=version, python=f"{major}.{minor}",
                                                next=f"{major}.{minor + 1}").encode()
    files[f"{info}/WHEEL"] = WHEEL.format(tag=tag).encode()
    files[f"{info}/LICENSE"] = pathlib.Path(licence).read_bytes()
    record = ""
    for name, content in sorted(files.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    folder.mkdir(parents=True, exist_ok=True)
    wheel = folder / f"vcp-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(name)  # of the first day that a ZIP file knows
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if ".so" in name else 0o644) << 16
            archive.writestr(entry, content)
    print(wheel)


main()
