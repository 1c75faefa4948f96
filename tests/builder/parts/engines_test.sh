#!/usr/bin/env bash
# Builds in parts on the engines themselves: Slurm, Snakemake and OpenMPI, with parts that are cancelled and killed.
# usage: engines_test.sh slurm|snakemake|snakemake_slurm|mpi VCP MAKE_SCAN SOURCE WORK
# Slurm's daemons run here, as whoever runs the test, with files and a key of their own, and end with the test.
# Ends with 77 (skipped) where an engine is not installed, or does not start on this machine.
set -euo pipefail
engine=$1 vcp=$2 make_scan=$3 scripts=$4/builder/cluster work=$5
case $engine in
slurm) tools="munged slurmctld slurmd sbatch setpriv python3" ;;
snakemake) tools=snakemake ;;
snakemake_slurm) tools="snakemake munged slurmctld slurmd sbatch setpriv python3" ;;
mpi) tools=mpirun ;;
esac
PATH=$PATH:/usr/sbin:/sbin
for tool in $tools; do
    command -v "$tool" >/dev/null || { echo "skipped: no $tool"; exit 77; }
done
user=$(id -un 2>/dev/null) || { echo "skipped: Slurm knows nobody without a name"; exit 77; }
unset "${!SLURM_@}" "${!SBATCH_@}" # of a cluster that runs the test itself
rm -rf "$work"
mkdir -p "$work/bin" "$work/a folder"
cd "$work"

daemons=()
sockets=
end() {
    local id
    for id in "${daemons[@]}"; do kill "$id" 2>/dev/null || true; done
    for id in "${daemons[@]}"; do
        for _ in $(seq 50); do kill -0 "$id" 2>/dev/null || break; sleep 0.1; done
        kill -9 "$id" 2>/dev/null || true
    done
    [ -z "$sockets" ] || rm -rf "$sockets"
}
trap end EXIT
trap 'exit 1' HUP INT TERM

fail() {
    echo "$*"
    tail -n 20 cluster/*.log "$work"/*/*.parts/logs/* 2>/dev/null || true
    exit 1
}
# within SECONDS COMMAND...: waits until the command succeeds, but no longer.
within() {
    local seconds=$1
    shift
    for _ in $(seq $((seconds * 10))); do
        if "$@"; then return 0; fi
        sleep 0.1
    done
    return 1
}
eventually() { within "$@" || fail "after $1 seconds, still not: ${*:2}"; }
comesUp() { within "$@" || { tail -n 20 cluster/*.log cluster/*.out; echo "skipped: no Slurm here: ${*:2}"; exit 77; }; }

# daemon NAME COMMAND...: runs until the test ends, however that ends.
daemon() {
    local name=$1
    shift
    setpriv --pdeathsig KILL "$@" >"cluster/$name.out" 2>&1 &
    daemons+=($!)
}
nodeIsIdle() { [ "$(sinfo --noheader --format=%T 2>/dev/null)" = idle ]; }

# A cluster of one machine, which claims eight processors whatever it has.
startSlurm() {
    local host ports
    host=$(hostname -s)
    ports=$(python3 -c 'import socket
sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
print(*(s.getsockname()[1] for s in sockets))')
    sockets=$(mktemp -d "${TMPDIR:-/tmp}/vcp_engines.XXXXXX") # a socket's path has at most 107 characters
    mkdir -p cluster/state cluster/spool
    (umask 077 && head -c 1024 /dev/urandom >"$sockets/key")
    cat >cluster/slurm.conf <<CONF
ClusterName=vcp
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports% *}
SlurmdPort=${ports#* }
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$sockets/munge
CredType=cred/munge
StateSaveLocation=$work/cluster/state
SlurmdSpoolDir=$work/cluster/spool
SlurmctldPidFile=$work/cluster/slurmctld.pid
SlurmdPidFile=$work/cluster/slurmd.pid
SlurmctldLogFile=$work/cluster/slurmctld.log
SlurmdLogFile=$work/cluster/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=1
PropagateResourceLimits=NONE
ReturnToService=2
KillWait=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=8 RealMemory=8000
PartitionName=all Nodes=$host Default=YES
CONF
    export SLURM_CONF=$work/cluster/slurm.conf
    daemon munged munged --foreground --force --key-file="$sockets/key" --socket="$sockets/munge" \
        --pid-file="$sockets/pid" --log-file="$work/cluster/munged.log" --seed-file="$sockets/seed"
    comesUp 20 test -S "$sockets/munge"
    daemon slurmctld slurmctld -D -i
    daemon slurmd slurmd -D
    comesUp 60 nodeIsIdle
}

# The program as a cluster's machines see it: the first time, vertices 1 and pages 0 are killed where they are, and
# the job of vertices 1 goes on without it until it is cancelled or its process killed. (What Slurm cancels it first
# lets go on, so a part of its own speed might be done by then.)
cat >bin/vcp <<PROGRAM
#!/usr/bin/env bash
marks=$(printf %q "$work/bin") program=$(printf %q "$vcp")
PROGRAM
cat >>bin/vcp <<'PROGRAM'
step="$2 $3"
dies() { # dies ARGUMENT...: starts the part, and kills it once it has a folder
    "$program" "$@" &
    part=$!
    until compgen -G "$5/$2-$3*" >"$marks/found"; do kill -0 $part || break; done
    kill -9 $part
    wait $part && rm -rf "$5/$2-$3" # it was faster: as if it had not been done
}
if [ "$step" = "vertices 1" ] && mkdir "$marks/stopped" 2>"$marks/said"; then
    dies "$@"
    sleep 60 &
    echo "${SLURM_JOB_ID:-}" >"$marks/stopped/job"
    echo $! >"$marks/stopped/part"
    wait
    exit 1
fi
if [ "$step" = "pages 0" ] && mkdir "$marks/killed" 2>"$marks/said"; then
    dies "$@"
    exit 1
fi
exec "$program" "$@"
PROGRAM
chmod +x bin/vcp

"$make_scan" --triangles 600000 --colour -o scan.ply
"$vcp" build scan.ply -o whole.vcp --progress none >said
plans() { # plans NAME: plans a build of "a folder/NAME.vcp", whose parts are yet to be stopped and killed
    rm -rf bin/stopped bin/killed
    plan="a folder/$1.vcp.parts" output="a folder/$1.vcp"
    "$vcp" build-plan scan.ply -o "$output" --parts 3 >said
}
same() { cmp whole.vcp "$output" || fail "$1: other bytes than vcp build writes"; }
# has STEP... -: the parts before the - are done, those after it are not.
has() {
    local wanted=1 part
    for part; do
        if [ "$part" = - ]; then
            wanted=
        elif [ -n "$wanted" ] && [ ! -e "$plan/$part/journal" ]; then
            fail "$part is not done"
        elif [ -z "$wanted" ] && [ -e "$plan/$part/journal" ]; then
            fail "$part is done"
        fi
    done
}
says() { grep "$1" "$2" >found || fail "$2 has no \"$1\": $(cat "$2")"; }

noJobs() { [ -z "$(squeue --noheader)" ]; }
submits() { VCP=$work/bin/vcp "$scripts/vcp-slurm.sh" "$plan" --mem=100M >submitted || fail "$(cat submitted)"; }

testSlurm() {
    startSlurm
    plans slurm
    submits
    eventually 60 test -s bin/stopped/part
    scancel "$(sed -n 's/^vertices: job \([0-9]*\),.*/\1/p' submitted)_1"
    eventually 60 noJobs
    has count-0 deal-0 deal-1 deal-2 vertices-0 vertices-2 - vertices-1 pages-0 pages-1 pages-2
    says CANCELLED "$plan/logs/vertices-1.txt"
    submits
    eventually 60 noJobs
    has vertices-1 pages-1 pages-2 - pages-0
    says "vertices 2: was done" "$plan/logs/vertices-2.txt"
    [ ! -e "$output" ] || fail "merged without a part"
    submits
    eventually 60 noJobs
    same "a part cancelled, and one killed"
}

snakes() { # snakes OPTION...: runs what is left of the plan
    HOME=$work CI=true snakemake --snakefile "$scripts/Snakefile" --config plan="$plan" vcp="$work/bin/vcp" "$@" >said 2>&1
}
endsStopped() { # has the part that stopped killed, and waits until Snakemake has failed by it
    local snake=$!
    eventually 60 test -s bin/stopped/part
    "$@"
    if wait $snake; then fail "Snakemake has not failed: $(cat said)"; fi
}

testSnakemake() {
    plans snake
    snakes --cores 2 --keep-going &
    endsStopped killsStopped
    has count-0 deal-0 deal-1 deal-2 vertices-0 vertices-2 - vertices-1 pages-0 pages-1
    if snakes --cores 2 --keep-going; then fail "pages 0 was killed, but Snakemake has succeeded"; fi
    has vertices-1 pages-1 pages-2 - pages-0
    snakes --cores 2 || fail "$(cat said)"
    same "Snakemake, a part killed twice"
}
killsStopped() { kill -9 "$(cat bin/stopped/part)"; }

testSnakemakeOnSlurm() {
    startSlurm
    plans snake
    snakes --jobs 8 --keep-going --cluster-sync "sbatch --wait --output=$work/job-%j.txt --cpus-per-task={threads}" &
    endsStopped cancelsStopped
    has count-0 deal-0 deal-1 deal-2 vertices-0 vertices-2 - vertices-1 pages-0 pages-1
    if snakes --jobs 8 --keep-going --cluster "sbatch --output=$work/job-%j.txt --cpus-per-task={threads}"; then
        fail "pages 0 was killed, but Snakemake has succeeded"
    fi
    has vertices-1 pages-1 pages-2 - pages-0
    snakes --jobs 8 --cluster "sbatch --output=$work/job-%j.txt --cpus-per-task={threads}" || fail "$(cat said)"
    same "Snakemake on Slurm"
}
cancelsStopped() { scancel "$(cat bin/stopped/job)"; }

testMpi() {
    local root=()
    [ "$(id -u)" != 0 ] || root=(--allow-run-as-root)
    runs() {
        HOME=$work mpirun "${root[@]}" --oversubscribe -n "$2" bash -c \
            '"$0" build-step "$1" "$OMPI_COMM_WORLD_RANK" --plan "$2" --threads 1 --progress none' \
            "$work/bin/vcp" "$1" "$plan" >said 2>&1
    }
    HOME=$work mpirun "${root[@]}" --oversubscribe -n 2 true >said 2>&1 || { cat said; echo "skipped: no MPI here"; exit 77; }
    plans mpi
    runs read 3 || fail "$(cat said)"
    runs count 1 || fail "$(cat said)"
    runs deal 3 || fail "$(cat said)"
    runs vertices 3 &
    local mpi=$!
    eventually 60 test -s bin/stopped/part
    killsStopped
    if wait $mpi; then fail "mpirun has not failed: $(cat said)"; fi
    has deal-2 - vertices-1
    runs vertices 3 || fail "$(cat said)"
    if runs pages 3; then fail "pages 0 was killed, but mpirun has succeeded"; fi
    has - pages-0
    runs pages 3 || fail "$(cat said)"
    runs merge 1 || fail "$(cat said)"
    same "mpirun"
}

case $engine in
slurm) testSlurm ;;
snakemake) testSnakemake ;;
snakemake_slurm) testSnakemakeOnSlurm ;;
mpi) testMpi ;;
esac
