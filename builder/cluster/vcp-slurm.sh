#!/usr/bin/env bash
# Submits a planned build to Slurm: a job array for each stage, each once the one before has succeeded.
#
#   vcp build-plan scan.ply -o scan.vcp --parts 64 --memory 6G
#   vcp-slurm.sh scan.vcp.parts --partition=short --cpus-per-task=4 --mem=8G --time=2:00:00
#
# What follows the folder goes to every sbatch. VCP names the program where it is not on the path. After a failure the
# same command submits all stages again: what is done is not run again.
set -euo pipefail

if [[ ${1:-} == --part ]]; then # what a task of an array runs: --part VCP STAGE PLAN
    exec "$2" build-step "$3" "$SLURM_ARRAY_TASK_ID" --plan "$4" --threads "${SLURM_CPUS_PER_TASK:-1}" --progress plain
fi

if [[ $# -eq 0 || $1 == -* ]]; then
    echo "usage: $0 OUT.vcp.parts [OPTION OF sbatch]..." >&2
    exit 2
fi
plan=$(cd "$1" && pwd)
shift
vcp=${VCP:-$(command -v vcp)} || { echo "$0: vcp is not on the path; set VCP" >&2; exit 1; }
parts=$(sed -n 's/^ *"parts": \([0-9]*\),*$/\1/p' "$plan/plan.json")
[[ -n $parts ]] || { echo "$0: $plan/plan.json is no plan" >&2; exit 1; }
mkdir -p "$plan/logs"

after=
for stage in read count deal vertices pages merge; do
    case $stage in count | merge) last=0 ;; *) last=$((parts - 1)) ;; esac
    after=$(sbatch --parsable --job-name="vcp-$stage" --array="0-$last" --kill-on-invalid-dep=yes \
        ${after:+--dependency=afterok:$after} --output="$plan/logs/$stage-%a.txt" "$@" \
        "$0" --part "$vcp" "$stage" "$plan")
    after=${after%%;*} # a cluster's name may follow
    echo "$stage: job $after, $((last + 1)) part(s)"
done
