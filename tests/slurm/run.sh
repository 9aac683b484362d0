#!/bin/bash
# Renders the built-in scene over a real Slurm on this machine, by the job script that README.md shows, and compares
# the picture with one rendered without Slurm, bit for bit. On the way the program is killed in one task, the machine of
# another is lost, and a third is told that its time is nearly up. Then, what users do next: the array is sent off again
# where all is done, a shard is missing, and another picture is sent off in the same folder.
#
#   tests/slurm/run.sh
#
# Needs Debian or Ubuntu, and root where Slurm is not installed yet; takes a few minutes. Everything runs as the
# present user from a temporary folder, with ports and a munge key of its own, so that a Slurm of the system is not
# touched, and all daemons end with the script. KEEP=1 keeps the folder. SPP=N renders N samples per pixel,
# 128 by default: where the tasks are too short to be killed, take more. LUXEL=PROGRAM takes that program in place of
# the one that is built here. Not part of `cargo test`.
set -euo pipefail

project=$(cd "$(dirname "$0")/../.." && pwd)
shards=4
spp=${SPP:-128}
patience=600 # seconds for all jobs

say() { echo "== $*"; }
fail() { echo "FAILED: $*" >&2; exit 1; }

install_slurm() {
    if ! command -v slurmctld slurmd munged sbatch >/dev/null; then
        say "installing slurm-wlm and munge"
        [ "$(id -u)" = 0 ] || fail "slurm-wlm and munge are not installed: install them, or run this as root"
        apt-get update -qq
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends slurm-wlm munge >/dev/null
    fi
    slurmctld -V
}

build_luxel() {
    if [ -z "${LUXEL:-}" ]; then
        say "building luxel"
        (cd "$project" && cargo build --release --quiet)
        LUXEL=${CARGO_TARGET_DIR:-$project/target}/release/luxel
    fi
    LUXEL=$(realpath "$LUXEL")
    mkdir "$work/bin"
    ln -s "$LUXEL" "$work/bin/luxel"
    export PATH="$work/bin:$PATH"
}

# A port on which nobody listens, above $1.
free_port() {
    local port=$1
    while (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do port=$((port + 1)); done
    echo "$port"
}

# Waits for the command $2... to succeed, $1 seconds at most.
wait_for() {
    local until=$((SECONDS + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ "$SECONDS" -lt "$until" ] || return 1
        sleep 0.3
    done
}

# One controller and two nodes of one processor each, all on this machine.
start_slurm() {
    say "starting munged, slurmctld and two slurmd"
    local me host base control one two
    me=$(id -un) host=$(hostname -s) base=$((20000 + $$ % 10000))
    control=$(free_port "$base")
    one=$(free_port $((control + 1)))
    two=$(free_port $((one + 1)))
    mkdir "$slurm"/{state,spool-n1,spool-n2}
    (umask 077 && head -c 1024 /dev/urandom >"$slurm/munge.key")
    munged --socket "$slurm/munge.socket" --key-file "$slurm/munge.key" --log-file "$slurm/munged.log" \
        --pid-file "$slurm/munged.pid" --seed-file "$slurm/munged.seed" --force 2>/dev/null
    # A job that is queued again waits until its credential has expired: 120 s by default.
    cat >"$slurm/slurm.conf" <<CONF
ClusterName=luxel
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$me
SlurmdUser=$me
SlurmctldPort=$control
AuthType=auth/munge
AuthInfo=socket=$slurm/munge.socket,cred_expire=5
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool-%n
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/slurmd-%n.pid
SlurmctldLogFile=$slurm/slurmctld.log
SlurmdLogFile=$slurm/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2,batch_sched_delay=0
ReturnToService=1
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$one CPUs=1
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$two CPUs=1
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
    export SLURM_CONF=$slurm/slurm.conf
    slurmctld -c
    wait_for 20 scontrol ping || fail "slurmctld does not answer; see $slurm/slurmctld.log"
    slurmd -N n1
    slurmd -N n2
    wait_for 30 nodes_idle || fail "the nodes do not come up; see $slurm"
    sinfo
}

nodes_idle() { [ "$(sinfo -h -t idle -o %D)" = 2 ]; }

# Ends what was started here, by the numbers that the daemons wrote down.
clean_up() {
    local pid_file
    if [ -n "${SLURM_CONF:-}" ]; then
        timeout 10 scancel --quiet --user "$(id -un)" || true
        wait_for 10 no_jobs || true
    fi
    for pid_file in "$slurm"/slurmd-*.pid "$slurm"/slurmctld.pid "$slurm"/munged.pid; do
        [ -f "$pid_file" ] || continue
        local pid
        pid=$(cat "$pid_file")
        kill "$pid" 2>/dev/null || true
        wait_for 10 gone "$pid" || kill -9 "$pid" 2>/dev/null || true
    done
    if [ -n "${KEEP:-}" ]; then say "kept $work"; else rm -rf "$work"; fi
}

gone() { ! kill -0 "$1"; }
no_jobs() { [ -z "$(squeue -h -o %i)" ]; }

# The job script of README.md, cut to this size.
job_script() {
    awk '/^```/ { inside = 0 } before ~ /^```/ && /^#!\/bin\/bash$/ { inside = 1 } inside { print } { before = $0 }' \
        "$project/README.md" >"$work/before.sh"
    cp "$work/before.sh" "$work/shards.sh"
    local change
    for change in 's/--array=1-16/--array=1-4/' 's#/16#/4#' 's/--cpus-per-task=8/--cpus-per-task=1/' \
        "s/--spp 4096/--spp $spp/" 's#scene\.xml#built-in.xml#'; do
        sed -i "$change" "$work/shards.sh"
        cmp -s "$work/shards.sh" "$work/before.sh" && fail "README.md's job script has nothing for $change"
        cp "$work/shards.sh" "$work/before.sh"
    done
    sed 's/^/    /' "$work/shards.sh"
}

# The job's number and the node of task $1, while it runs.
running() {
    squeue -h -r -t RUNNING -o '%K %A %N' | awk -v task="$1" '$1 == task { print $2, $3; found = 1 } END { exit !found }'
}

# The process number of luxel in job $1 on node $2, once there.
renderer() {
    local pid
    for pid in $(scontrol listpids "$1" "$2" 2>/dev/null | awk 'NR > 1 { print $1 }'); do
        [ "$(cat "/proc/$pid/comm" 2>/dev/null)" = luxel ] && echo "$pid" && return
    done
    return 1
}

restarts() { scontrol show job "$1" | grep -o 'Restarts=[0-9]*' | head -1; }

# Kills the program in task $1 while it renders.
kill_renderer() {
    local job node pid
    wait_for "$patience" running "$1" || fail "task $1 does not start"
    read -r job node < <(running "$1")
    wait_for 20 renderer "$job" "$node" || fail "no luxel runs in task $1"
    sleep 2
    pid=$(renderer "$job" "$node") || fail "task $1 was too short to be killed: raise SPP"
    kill -9 "$pid"
    say "killed luxel in task $1 (job $job on $node, process $pid)"
}

# Tells Slurm that the machine of task $1 is lost, and later back.
lose_machine() {
    local job node
    wait_for "$patience" running "$1" || fail "task $1 does not start"
    read -r job node < <(running "$1")
    sleep 2
    running "$1" >/dev/null || fail "task $1 was too short to lose its machine: raise SPP"
    scontrol update nodename="$node" state=down reason="lost, for a test"
    say "lost $node with task $1 (job $job)"
    sleep 3
    wait_for 20 scontrol update nodename="$node" state=resume || fail "$node does not come back"
}

# Sends task $1 the signal that Slurm sends when the time is nearly up.
signal_task() {
    local job node
    wait_for "$patience" running "$1" || fail "task $1 does not start"
    read -r job node < <(running "$1")
    wait_for 20 renderer "$job" "$node" || fail "no luxel runs in task $1"
    sleep 5
    scancel --batch --signal=USR1 "$job" || fail "task $1 was too short to be told: raise SPP"
    say "told task $1 (job $job on $node) that its time is nearly up"
}

# Waits for all jobs, and checks how often each task was queued again: $1 is the array, the rest the numbers expected.
all_done() {
    local array=$1 task=0 expected tries
    shift
    wait_for "$patience" no_jobs || { squeue; fail "the jobs do not end within $patience s"; }
    for expected in "$@"; do
        task=$((task + 1))
        tries=$(restarts "${array}_$task")
        echo "task $task: $tries"
        [ "$tries" = "Restarts=$expected" ] || fail "task $task has $tries, expected Restarts=$expected"
    done
}

# Fails unless the file $1 has the text $2.
has() { grep -q -e "$2" "$1" || { cat "$1"; fail "$1 does not say: $2"; }; }

# What users do after the picture is done.
afterwards() {
    say "the same array again: all is there"
    local again
    again=$(sbatch --parsable shards.sh)
    all_done "$again" 0 0 0 0
    for task in $(seq "$shards"); do
        has "slurm-${again}_$task.out" "shard-$task.exr is complete: nothing is left to render"
    done
    tail -n 2 "slurm-${again}_1.out"
    say "a shard is missing"
    mkdir aside
    mv shard-3.exr aside
    if luxel merge shard-*.exr -o none.exr 2>missing.log; then fail "a picture was merged of three shards"; fi
    has missing.log "shards are missing: 3/4"
    cat missing.log
    mv aside/shard-3.exr .
    say "another picture in the same folder"
    sed -e 's/--spp [0-9]*/--spp 4/' -e 's/-lt 9/-lt 0/' shards.sh >others.sh
    again=$(sbatch --parsable others.sh)
    all_done "$again" 0 0 0 0
    has "slurm-${again}_1.out" "cannot go on from shard-1.exr: end: $spp samples per pixel there, 4 samples per pixel here"
    cat "slurm-${again}_1.out"
    luxel merge shard-*.exr -o picture.pfm 2>/dev/null
    cmp picture.pfm alone.pfm || fail "the other picture spoiled the first"
}

work=$(mktemp -d "${TMPDIR:-/tmp}/luxel-slurm.XXXXXX")
slurm=$work/slurm
mkdir "$slurm"
# munged wants a path that others cannot change, slurmd one that it can read.
chmod 755 "$work" "$slurm"
trap clean_up EXIT
trap 'exit 130' INT TERM

install_slurm
build_luxel
cd "$work"
cp "$project/scenes/cornell-balls.xml" built-in.xml

say "the job script"
job_script
start_slurm

array=$(sbatch --parsable shards.sh)
merge=$(sbatch --parsable --dependency=afterok:"$array" --kill-on-invalid-dep=yes --output=merge.log \
    --wrap 'luxel merge shard-*.exr -o picture.exr -o picture.pfm')
say "submitted array $array and merge $merge"
lose_machine 1
signal_task 2
# The last task has the number of the whole array for its own job: queueing that again must leave the others alone.
kill_renderer "$shards"
all_done "$array" 1 1 0 1
say "logs of the tasks"
tail -n 4 slurm-*.out merge.log
has "slurm-${array}_2.out" "going on from shard-2.checkpoint.exr"
[ -f picture.exr ] || fail "there is no merged picture"

say "the same without Slurm"
luxel render built-in.xml --spp "$spp" --progress never -o alone.exr -o alone.pfm
cmp picture.pfm alone.pfm || fail "the pictures differ"
luxel compare picture.exr alone.exr
afterwards
if compgen -G '.luxel-*.tmp'; then fail "temporary files are left"; fi
say "PASSED: the picture of $shards shards over Slurm is that of one machine, bit for bit"
