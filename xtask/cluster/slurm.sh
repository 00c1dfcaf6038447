#!/bin/sh
# A Slurm of one's own on this machine: munged, slurmctld and one slurmd for each virtual node, all on the loopback interface.
#
#   slurm.sh start DIR NODES   starts it; what `export SLURM_CONF=DIR/slurm.conf` reaches then
#   slurm.sh kill DIR NODE     kills a node with what runs on it, as a power failure does
#   slurm.sh revive DIR NODE   starts the node again
#   slurm.sh stop DIR          ends it
#
# Needs root and Debian's packages slurm-wlm and munge (apt-get install --no-install-recommends slurm-wlm munge).
set -eu
action=$1
dir=$2
export SLURM_CONF="$dir/slurm.conf"

# Whether a process has not ended, waited for or not.
runs() {
    state=$(ps -o state= -p "$1") && [ "${state#Z}" = "$state" ]
}

# Ends the process of a file, and waits for its end.
end() {
    [ -f "$1" ] || return 0
    pid=$(cat "$1")
    kill "-$2" "$pid" 2> /dev/null || return 0
    for _ in $(seq 100); do
        runs "$pid" || break
        sleep 0.1
    done
    if runs "$pid"; then
        echo "process $pid of $1 does not end" >&2
        exit 1
    fi
    # The number may be another process's soon.
    rm -f "$1"
}

case $action in
start)
    nodes=$3
    mkdir -p "$dir/munge" "$dir/run" "$dir/log" "$dir/state"
    chmod 700 "$dir/munge"
    head -c 1024 /dev/urandom > "$dir/munge/key"
    chmod 400 "$dir/munge/key"
    munged --force --key-file="$dir/munge/key" --socket="$dir/run/munge.sock" --pid-file="$dir/munge/munged.pid" \
        --log-file="$dir/munge/munged.log" --seed-file="$dir/munge/seed" --num-threads=2
    host=$(hostname -s)
    cat > "$SLURM_CONF" << C
ClusterName=loop
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
AuthType=auth/munge
AuthInfo=socket=$dir/run/munge.sock
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool_%n
SlurmctldPidFile=$dir/run/slurmctld.pid
SlurmdPidFile=$dir/run/slurmd_%n.pid
SlurmctldLogFile=$dir/log/slurmctld.log
SlurmdLogFile=$dir/log/slurmd_%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
ReturnToService=2
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,defer_batch
KillWait=2
SlurmdTimeout=10
RequeueExit=75
MailProg=/bin/true
NodeName=n[1-$nodes] NodeHostname=$host NodeAddr=127.0.0.1 Port=[17001-$((17000 + nodes))] CPUs=1 State=UNKNOWN
PartitionName=main Nodes=n[1-$nodes] Default=YES MaxTime=INFINITE State=UP
C
    slurmctld -c -f "$SLURM_CONF"
    for k in $(seq "$nodes"); do
        mkdir -p "$dir/spool_n$k"
        slurmd -N "n$k" -f "$SLURM_CONF"
    done
    for _ in $(seq 100); do
        [ "$(sinfo --noheader --states=idle --format=%D 2> /dev/null)" = "$nodes" ] && exit 0
        sleep 0.2
    done
    sinfo >&2
    exit 1
    ;;
kill)
    end "$dir/run/slurmd_$3.pid" KILL
    # Without its daemon a step would go on. Its processes are known by their environment; the one that holds them, their parent, goes
    # first, or it would report that the task has failed.
    # Those of another Slurm, whose nodes have the same names, have another configuration.
    processes=$(grep -lzx "SLURMD_NODENAME=$3" /proc/[0-9]*/environ 2> /dev/null \
        | xargs -r grep -lzxF "SLURM_CONF=$SLURM_CONF" 2> /dev/null | cut -d / -f 3)
    for process in $processes; do
        parent=$(ps -o ppid= -p "$process" | tr -d ' ')
        case $(ps -o args= -p "${parent:-1}") in
        slurmstepd*) kill -KILL "$parent" 2> /dev/null || true ;;
        esac
    done
    for process in $processes; do kill -KILL "$process" 2> /dev/null || true; done
    ;;
revive)
    slurmd -N "$3" -f "$SLURM_CONF"
    ;;
stop)
    for pid in "$dir"/run/slurmd_*.pid "$dir/run/slurmctld.pid" "$dir/munge/munged.pid"; do end "$pid" TERM; done
    ;;
*)
    echo "expected start, kill, revive or stop, got $action" >&2
    exit 2
    ;;
esac
