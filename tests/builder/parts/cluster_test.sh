#!/usr/bin/env bash
# A build in parts through the command line and the scripts for clusters: the bytes of `vcp build`.
# usage: cluster_test.sh VCP MAKE_SCAN FAILING_CALLS_LIBRARY SOURCE WORK
set -euo pipefail
vcp=$1 make_scan=$2 library=$3 scripts=$4/builder/cluster work=$5
rm -rf "$work"
mkdir -p "$work/bin" "$work/a folder"
cd "$work"

fail() {
    echo "$*"
    exit 1
}
same() { cmp whole.vcp "$1" || fail "$2: other bytes than vcp build writes"; }

"$make_scan" --triangles 60000 --colour -o scan.ply
"$vcp" build scan.ply -o whole.vcp --progress none >said

# Killed again and again, at random: only what was not done is run again.
"$vcp" build-plan scan.ply -o killed.vcp --parts 3 --json >planned
grep '"parts": *3' planned >said || fail "$(cat planned)"
RANDOM=5 kills=0
for stage in read count deal vertices pages merge; do
    case $stage in count | merge) parts=0 ;; *) parts="2 0 1" ;; esac
    for part in $parts; do
        for _ in 1 2 3 4; do
            "$vcp" build-step "$stage" "$part" --plan killed.vcp.parts --progress none >said 2>&1 &
            sleep "0.0$((RANDOM % 10))"
            kill -9 $! 2>/dev/null && kills=$((kills + 1))
            wait $! || true
        done
        "$vcp" build-step "$stage" "$part" --plan killed.vcp.parts --progress none >said
        [ "$stage" = merge ] && continue
        "$vcp" build-step "$stage" "$part" --plan killed.vcp.parts --progress none >said
        grep "was done" said >found || fail "$stage $part was run twice: $(cat said)"
    done
done
[ $kills -gt 0 ] || fail "nothing was killed"
same killed.vcp "after $kills kills"

# One line each, and nothing else, for what is wrong.
refused() { # WANTED COMMAND...
    local wanted=$1
    shift
    if "$@" >out 2>said; then fail "$* succeeded"; fi
    grep "$wanted" said >found || fail "$*: $(cat said)"
    [ "$(wc -l <said)" = 1 ] || fail "$*: not one line: $(cat said)"
}
refused "there already" "$vcp" build-plan scan.ply -o killed.vcp --parts 3
refused "cannot be built in parts" "$vcp" build-plan - -o other.vcp --parts 3
refused "plan.json" "$vcp" build-step read 0 --plan .
refused "parts 0 to 2" "$vcp" build-step pages 3 --plan killed.vcp.parts
rm -r killed.vcp.parts/vertices-1
rm -r killed.vcp.parts/pages-*
refused "vertices 1" "$vcp" build-step pages 0 --plan killed.vcp.parts --progress none
refused "Read-only file system" env LD_PRELOAD="$library" FAIL_AT=1 FAIL_ERRNO=30 FAIL_ON=1 \
    "$vcp" build-step vertices 1 --plan killed.vcp.parts --progress none
if [ "$(id -u)" != 0 ]; then
    chmod a-w killed.vcp.parts
    refused "ermission" "$vcp" build-step vertices 1 --plan killed.vcp.parts --progress none
    chmod u+w killed.vcp.parts
fi

# A full disk, from each call that writes on: one line, and the folder as it was.
"$make_scan" --triangles 10000 -o small.ply
"$vcp" build small.ply -o small_whole.vcp --progress none >said
"$vcp" build-plan small.ply -o full.vcp --parts 2 >said
calls=0
for step in "read 1" "read 0" "count 0" "deal 1" "deal 0" "vertices 1" "vertices 0" "pages 1" "pages 0" "merge 0"; do
    for ((n = 1; ; ++n)); do
        rm -f failed
        before=$(ls full.vcp.parts) status=0
        # shellcheck disable=SC2086
        LD_PRELOAD=$library FAIL_AT=$n FAIL_ERRNO=28 FAIL_ON=1 FAIL_MARK=failed \
            "$vcp" build-step $step --plan full.vcp.parts --threads 1 --progress none >out 2>said || status=$?
        [ -e failed ] || break
        calls=$((calls + 1))
        [ $status = 1 ] || fail "$step, call $n: exit status $status: $(cat said)"
        [ "$(wc -l <said)" = 1 ] || fail "$step, call $n: not one line: $(cat said)"
        grep "No space left on device" said >found || fail "$step, call $n does not say why: $(cat said)"
        # A whole part may only not be durable yet.
        if grep "make the folder durable" said >found; then
            rm -rf "full.vcp.parts/${step/ /-}" full.vcp
        fi
        [ "$before" = "$(ls full.vcp.parts)" ] || fail "$step, call $n left $(ls full.vcp.parts): $(cat said)"
        [ ! -e full.vcp ] && [ ! -e full.vcp.partial ] || fail "$step, call $n left a file: $(cat said)"
    done
    [ $status = 0 ] || fail "$step: nothing failed, but: $(cat said)"
done
[ $calls -ge 60 ] || fail "only $calls calls were counted"
cmp small_whole.vcp full.vcp || fail "after a full disk: other bytes"

# The script for Slurm, with an sbatch that runs the parts at once, the last one first.
cat >bin/sbatch <<'SBATCH'
#!/usr/bin/env bash
set -euo pipefail
for word; do
    shift
    case $word in
    --array=0-*) last=${word#--array=0-} ;;
    --dependency=*) [ "$word" = "--dependency=afterok:$(cat last_job)" ] || exit 9 ;;
    --*) ;;
    *) set -- "$word" "$@" && break ;;
    esac
done
for ((part = last; part >= 0; --part)); do SLURM_ARRAY_TASK_ID=$part "$@" >>sbatch_said 2>&1; done
echo $((++last)) >last_job
cat last_job
SBATCH
chmod +x bin/sbatch
"$vcp" build-plan scan.ply -o "a folder/slurm.vcp" --parts 2 >said
PATH=$work/bin:$PATH VCP=$vcp "$scripts/vcp-slurm.sh" "a folder/slurm.vcp.parts" --mem=1G >said || fail "$(cat said sbatch_said)"
same "a folder/slurm.vcp" "vcp-slurm.sh"
[ "$(wc -l <said)" = 6 ] || fail "$(cat said)"
