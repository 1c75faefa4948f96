#!/usr/bin/env bash
# Every call that writes fails once: one clear line, no half output, and the next build ends in the same bytes.
#   failing_calls_test.sh VCP FAILING_CALLS_LIBRARY WORK_DIR
set -euo pipefail
vcp=$1 library=$2 work=$3
rm -rf "$work"
mkdir -p "$work/temp"
cd "$work"

fail() { echo "FAILED: $*"; exit 1; }

# A ring of 720 triangles with waves: several levels.
awk 'BEGIN {
    pi = atan2(0, -1); n = 30; m = 12;
    for (i = 0; i < n; ++i) for (j = 0; j < m; ++j) {
        a = 2 * pi * i / n; b = 2 * pi * j / m; r = 2 + (0.6 + 0.05 * sin(5 * a)) * cos(b);
        printf "v %.9g %.9g %.9g\n", r * cos(a), r * sin(a), 0.6 * sin(b);
    }
    for (i = 0; i < n; ++i) for (j = 0; j < m; ++j) {
        a = i * m + j; b = (i + 1) % n * m + j; c = (i + 1) % n * m + (j + 1) % m; d = i * m + (j + 1) % m;
        print "f", a + 1, b + 1, c + 1; print "f", a + 1, c + 1, d + 1;
    }
}' >ring.obj
build=("$vcp" build "$work/ring.obj" --cell 0.1 --memory 200M --threads 2 --temp temp --checkpoint 0 --progress none -o out.vcp)
"${build[@]}" >/dev/null
mv out.vcp whole.vcp

# Writes that are interrupted and take part of their bytes are no failure.
LD_PRELOAD=$library FAIL_SHORT=1 "${build[@]}" >/dev/null
cmp whole.vcp out.vcp || fail "short writes give other bytes"
rm out.vcp

# Where folders cannot be exchanged, such as on NFS, the old one steps aside.
for flags in "" 1; do
    folder=("$vcp" build ring.obj --cell 0.1 --memory 200M --threads 2 --temp temp --progress none --shards 64K -o)
    for turn in made replaced; do
        LD_PRELOAD=$library ${flags:+env FAIL_FLAGS=1} "${folder[@]}" "folder$flags" >/dev/null || fail "no folder $turn"
    done
    mkdir "other$flags"
    echo mine >"other$flags/notes"
    if LD_PRELOAD=$library ${flags:+env FAIL_FLAGS=1} "${folder[@]}" "other$flags" >/dev/null 2>err.txt; then fail "other$flags was replaced"; fi
    grep -q "holds notes" err.txt || fail "$(cat err.txt)"
    [ "$(cat "other$flags/notes")" = mine ]
done
diff -r folder folder1
[ -z "$(ls -d folder*unfinished* 2>/dev/null)" ] || fail "left: $(ls -d folder*)"
for named in . .. folder/.; do
    if "$vcp" build ring.obj --cell 0.1 --shards 64K --progress none --overwrite -o $named >/dev/null 2>err.txt; then fail "-o $named"; fi
    grep -q "has no name of its own" err.txt || fail "-o $named: $(cat err.txt)"
done

# sweep FIRST STEP ERRNO [ON]: fails one call, then the one STEP later, ...; with ON all calls after it, too. In a folder
# of its own.
sweep() {
    local n status
    local -a on=()
    if [ $# -gt 3 ]; then on=(FAIL_ON=1); fi
    mkdir -p "$work/sweep$1-$2/temp"
    cd "$work/sweep$1-$2"
    for ((n = $1; ; n += $2)); do
        rm -f failed
        status=0
        env LD_PRELOAD="$library" FAIL_AT=$n FAIL_ERRNO="$3" FAIL_MARK=failed ${on[@]+"${on[@]}"} "${build[@]}" >/dev/null 2>err.txt || status=$?
        if [ ! -e failed ]; then
            [ "$status" -eq 0 ] || fail "call $n: nothing failed, but the exit status is $status: $(cat err.txt)"
            cmp "$work/whole.vcp" out.vcp || fail "call $n: other bytes"
            rm out.vcp
            break
        fi
        [ "$status" -eq 1 ] || fail "call $n, error $3: exit status $status: $(cat err.txt)"
        [ "$(wc -l <err.txt)" -eq 1 ] || fail "call $n, error $3: $(wc -l <err.txt) lines: $(cat err.txt)"
        grep -Eq 'No space left on device|Input/output error' err.txt || fail "call $n, error $3 does not say why: $(cat err.txt)"
        grep -Eq '^vcp: (out\.vcp|temp|\.)' err.txt || fail "call $n, error $3 does not say where: $(cat err.txt)"
        if [ -e out.vcp ]; then
            # Only its name's durability may be in doubt.
            cmp "$work/whole.vcp" out.vcp || fail "call $n, error $3 left a wrong file"
            grep -q "is complete" err.txt || fail "call $n, error $3 left a file: $(cat err.txt)"
        fi
        [ ! -e out.vcp.partial ] || fail "call $n, error $3 left out.vcp.partial"
        # What is kept is said.
        if [ -n "$(ls -A temp)" ] && [ ! -e out.vcp ]; then grep -q -- "--resume" err.txt || fail "call $n, error $3 left $(find temp) and does not say so: $(cat err.txt)"; fi
        "${build[@]}" --resume >/dev/null 2>err.txt || fail "after call $n, error $3: --resume: $(cat err.txt)"
        cmp "$work/whole.vcp" out.vcp || fail "after call $n, error $3 the file differs"
        [ -z "$(ls -A temp)" ] || fail "after call $n, error $3 $(ls -A temp) is left"
        rm out.vcp
    done
    [ "$n" -gt 30 ] || fail "only $n calls were counted"
    echo "$(((n - $1) / $2)) calls failed"
}
# Every call once, and every third with all after it. The disk is what is waited for, so they run side by side.
enospc=28 eio=5
sweeps=()
for each in "1 2 $enospc" "2 2 $eio" "1 6 $eio on" "4 6 $enospc on"; do
    read -ra each <<<"$each"
    sweep "${each[@]}" &
    sweeps+=($!)
done
status=0
for each in "${sweeps[@]}"; do wait "$each" || status=1; done
exit "$status"
