#!/usr/bin/env bash
# A build in parts through the command line and the scripts for clusters: the bytes of `vcp build`.
# usage: cluster_test.sh VCP MAKE_SCAN SOURCE WORK
set -euo pipefail
vcp=$1 make_scan=$2 scripts=$3/builder/cluster work=$4
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
for stage in deal vertices pages merge; do
    case $stage in vertices | pages) parts="2 0 1" ;; *) parts=0 ;; esac
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
refused "plan.json" "$vcp" build-step deal 0 --plan .
refused "parts 0 to 2" "$vcp" build-step pages 3 --plan killed.vcp.parts
rm -r killed.vcp.parts/vertices-1
rm -r killed.vcp.parts/pages-*
refused "vertices 1" "$vcp" build-step pages 0 --plan killed.vcp.parts --progress none
if [ "$(id -u)" != 0 ]; then
    chmod a-w killed.vcp.parts
    refused "ermission" "$vcp" build-step vertices 1 --plan killed.vcp.parts --progress none
    chmod u+w killed.vcp.parts
fi

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
[ "$(wc -l <said)" = 4 ] || fail "$(cat said)"
