#!/usr/bin/env python3
"""The binary interface of libvcp.so against what is written down: tests/widget/abi.txt.

usage: abi_test.py HEADER LIBRARY CC ABI_FILE [--update]

A program that was built against an older vcp.h goes on working while nothing of what is written down changes: the
SONAME, the exported functions and their parameters, the values of enumerators, the offset, size and type of each
field. What is new is written down with --update, and looked at in review; what is changed or gone needs a new SONAME.
"""
import os
import re
import subprocess
import sys
import tempfile


def without_comments(text):
    return re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)


def joined(text):
    """The text with one space between words, and none beside brackets, stars and commas."""
    return re.sub(r"\s*([(),*\[\]])\s*", r"\1", " ".join(text.split())).replace(",", ", ")


def structs_of(text):
    """Pairs of a struct's name and its fields: (name, type)."""
    for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\n\} \1;", text, flags=re.S):
        fields = []
        for line in (part.strip() for part in body.split(";")):
            if not line or re.search(r"\breserved$", line):  # A later field may take its place.
                continue
            function = re.match(r"(.*?)\(\s*\*\s*(\w+)\s*\)(.*)$", line, flags=re.S)
            if function:
                fields.append((function[2], joined(function[1] + "(*)" + function[3])))
                continue
            kind, names = re.match(r"(.*?[\s*])((?:\w+(?:\[\w+\])*)(?:\s*,\s*\w+(?:\[\w+\])*)*)$", line, flags=re.S).groups()
            for each in names.split(","):
                field, size = re.match(r"(\w+)(.*)", each.strip()).groups()
                fields.append((field, joined(kind + size)))
        yield name, fields


def program_for(header, structs, enumerators):
    lines = ["#include <stdio.h>", f'#include "{header}"', "int main(void) {"]
    for name, fields in structs:
        lines.append("    { static %s s;" % name)
        for field, kind in fields:
            lines.append('    printf("field %s.%s at %%zu of %%zu: %s\\n", offsetof(%s, %s), sizeof(s.%s));'
                         % (name, field, kind, name, field, field))
        lines.append("    }")
    for name in enumerators:
        lines.append('    printf("value %s %%ld\\n", (long)%s);' % (name, name))
    return "\n".join(lines + ["    return 0;", "}", ""])


def output_of(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def interface(header, library, compiler):
    text = without_comments(open(header).read())
    enumerators = [name for body in re.findall(r"enum \{(.*?)\}", text, flags=re.S)
                   for name in re.findall(r"(VCP_\w+)\s*=", body)]
    structs = list(structs_of(text))
    with tempfile.TemporaryDirectory() as folder:
        source, program = os.path.join(folder, "abi.c"), os.path.join(folder, "abi")
        with open(source, "w") as file:
            file.write(program_for(os.path.abspath(header), structs, enumerators))
        subprocess.run([compiler, "-std=c99", source, "-o", program], check=True)
        lines = output_of(program).splitlines()
    declared = {re.search(r"(\w+)\(", each)[1]: joined(each) for each in re.findall(r"^VCP_API (.*?);", text, flags=re.S | re.M)}
    exported = [line.split()[-1] for line in output_of("nm", "-D", "--defined-only", library).splitlines()]
    if set(exported) != set(declared):
        sys.exit(f"exported, and not declared in vcp.h: {sorted(set(exported) - set(declared))}; "
                 f"declared, and not exported: {sorted(set(declared) - set(exported))}")
    lines += ["function " + text for text in declared.values()]
    soname = re.search(r"SONAME.*\[(.*)\]", output_of("readelf", "-d", library))
    lines.append("soname " + (soname[1] if soname else "none"))
    return sorted(lines)


def main():
    header, library, compiler, written = sys.argv[1:5]
    now = interface(header, library, compiler)
    # A header that is no longer understood would have nothing to compare.
    assert len(now) > 200, f"only {len(now)} lines of the interface were found"
    if "--update" in sys.argv:
        with open(written, "w") as file:
            file.write("\n".join(now) + "\n")
        return
    before = open(written).read().splitlines()
    gone, new = sorted(set(before) - set(now)), sorted(set(now) - set(before))
    for line in gone:
        print("changed or gone:", line)
    for line in new:
        print("new:", line)
    if gone:
        sys.exit("older programs would break: put back what was, or give the library a new SONAME")
    if new:
        sys.exit("the interface grew: look at the new lines, then run this test's command with --update")
    print(len(now), "lines of the interface are as written down")


main()
