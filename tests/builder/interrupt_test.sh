#!/usr/bin/env bash
# Builds that are killed, resumed and stopped end in the same bytes.
#   interrupt_test.sh VCP MAKE_SCAN WORK_DIR [KILLS [SEED]]
set -euo pipefail
vcp=$1 make_scan=$2 work=$3 kills=${4:-12} seed=${5:-1}
rm -rf "$work"
mkdir -p "$work/temp"
cd "$work"

fail() { echo "FAILED: $*"; exit 1; }

"$make_scan" --triangles 200000 --seed 5 --colour -o scan.ply
# Little memory, so that there are several bins, and what is done is recorded after each.
options=(scan.ply --temp temp --checkpoint 0 --progress none)
small=(--memory 165M --threads 2)
"$vcp" build "${options[@]}" "${small[@]}" -o whole.vcp >/dev/null
[ -z "$(ls -A temp)" ] || fail "a build left $(ls -A temp) in the temporary folder"

# How long a build takes says where the kills fall, and nothing else.
now() { date +%s%N; }
began=$(now)
"$vcp" build "${options[@]}" "${small[@]}" -o whole2.vcp >/dev/null
span=$(($(now) - began))
cmp whole.vcp whole2.vcp || fail "two builds differ"

RANDOM=$seed
# attempt FRACTION_OF_1000 SIGNAL: a build or its continuation, sent the signal after that part of a build's
# time; its exit status.
attempt() {
    local status=0 pid
    "$vcp" build "${options[@]}" "${small[@]}" --resume -o out.vcp >/dev/null 2>err.txt &
    pid=$!
    sleep "$(printf '%d.%09d' $((span * $1 / 1000 / 1000000000)) $((span * $1 / 1000 % 1000000000)))"
    kill "-$2" "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || status=$?
    return "$status"
}

killed=0 files=0
finish() {
    "$vcp" build "${options[@]}" "${small[@]}" --resume -o out.vcp >/dev/null 2>err.txt || fail "kill $killed: --resume: $(cat err.txt)"
    cmp whole.vcp out.vcp || fail "after kill $killed, seed $seed, the file differs"
    [ -z "$(ls -A temp)" ] || fail "after kill $killed $(ls -A temp) is left in the temporary folder"
    rm -f out.vcp out.vcp.partial
    files=$((files + 1))
}
while [ "$killed" -lt "$kills" ]; do
    # Some builds are killed once, others several times in a row.
    for ((again = RANDOM % 4; again >= 0 && killed < kills; --again)); do
        status=0
        attempt $((RANDOM % 1050)) KILL || status=$?
        if [ "$status" -eq 0 ]; then break; fi  # it was done before
        [ "$status" -eq 137 ] || fail "exit status $status: $(cat err.txt)"
        killed=$((killed + 1))
        if [ -e out.vcp ]; then cmp whole.vcp out.vcp || fail "a killed build left half a file"; fi
    done
    finish
done
echo "$killed kills, $files files, all the same"

# Ctrl-C says how to go on; until then nothing has the output's name.
for part in 500 600 700 400 300; do
    status=0
    attempt "$part" INT || status=$?
    [ "$status" -ne 0 ] && break
    rm -f out.vcp
done
[ "$status" -eq 1 ] || fail "Ctrl-C: exit status $status"
[ "$(wc -l <err.txt)" -eq 1 ] || fail "Ctrl-C: $(wc -l <err.txt) lines"
grep -q "cancelled" err.txt || fail "Ctrl-C: $(cat err.txt)"
grep -q -- "--resume" err.txt || fail "Ctrl-C does not say how to go on: $(cat err.txt)"
[ ! -e out.vcp ] && [ ! -e out.vcp.partial ] || fail "Ctrl-C left an output"

# Other options are not what was interrupted; the work stays.
before=$(ls temp/out.vcp.build)
status=0
"$vcp" build "${options[@]}" "${small[@]}" --cell 0.01 --resume -o out.vcp >/dev/null 2>err.txt || status=$?
[ "$status" -eq 2 ] || fail "--resume with another --cell: exit status $status"
grep -q "other inputs or options" err.txt || fail "--resume with another --cell: $(cat err.txt)"
[ "$(ls temp/out.vcp.build)" = "$before" ] || fail "a refused --resume changed the temporary files"

# Threads and memory may change.
"$vcp" build "${options[@]}" --memory 300M --threads 3 --resume -o out.vcp >/dev/null 2>err.txt || fail "--resume with more memory: $(cat err.txt)"
cmp whole.vcp out.vcp || fail "with other threads and memory the file differs"
[ -z "$(ls -A temp)" ] || fail "$(ls -A temp) is left in the temporary folder"

# Without --resume it begins again.
attempt 600 KILL || true
rm -f out.vcp
"$vcp" build "${options[@]}" "${small[@]}" -o out.vcp >/dev/null
cmp whole.vcp out.vcp || fail "a build over an unfinished one differs"
[ -z "$(ls -A temp)" ] || fail "$(ls -A temp) is left in the temporary folder"
[ "$(ls -A)" = "$(printf '%s\n' err.txt out.vcp scan.ply temp whole.vcp whole2.vcp)" ] || fail "left behind: $(ls -A)"
