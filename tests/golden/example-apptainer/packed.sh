#!/bin/bash
#SBATCH --job-name=friction.0a1b2c3d
#SBATCH --array=0-1
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=36
#SBATCH --mem=36864M
#SBATCH --time=03:05:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=jobs/001/%a.txt
#SBATCH --partition=standard
# 72 runs of the sweep in /home/user/sweeps/friction, made by `smarticles`.
# By hand:  cd -- /home/user/sweeps/friction && sbatch jobs/001/array.sh
# Task number i computes 36 runs at once, one core each: lines 36 i + 1 and following of
# jobs/001/runs.txt. Runs that are done or failed are skipped, others continue from their last checkpoint.
set -euo pipefail
cd -- /home/user/sweeps/friction

# One thread per run: results depend on the number of threads, and more threads than cores are slow.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
set +u # module systems use variables that are not set
module load apptainer
set -u
# The run script of the image is smarticles; the sweep has one path inside and outside of the container.
smarticles=(apptainer run --bind "$PWD" /shared/images/smarticles.sif)

task=${SLURM_ARRAY_TASK_ID:?submit this script with sbatch}
mapfile -t -s $((task * 36)) -n 36 runs <jobs/001/runs.txt
began=jobs/001/$task.began
: >"$began" # this task makes all newer files
pids=()
signalled=

state() {
    if [ -e "runs/$1/done.json" ]; then
        echo finished
    elif grep -qs '"status": "failed"' "runs/$1/failed.json"; then
        echo failed
    else
        echo open
    fi
}

start() {
    local resume=()
    [ ! -e "runs/$1/run.json" ] || resume=(--resume)
    "${smarticles[@]}" run "scenes/$1.yaml" --out "runs/$1" "${resume[@]}" >>"logs/$1.txt" 2>&1 &
    pids+=("$!")
}

send() {
    local pid
    for pid in "${pids[@]}"; do
        kill -s "$1" "$pid" 2>/dev/null || true # the process may have ended
    done
}

computing() {
    local pid
    for pid in "${pids[@]}"; do
        ! kill -0 "$pid" 2>/dev/null || return 0
    done
    return 1
}

# USR1: the time limit is near; runs end at their next checkpoint. TERM: runs end at once.
trap 'signalled=USR1; send USR1' USR1
trap 'signalled=TERM; send TERM' TERM

mkdir -p runs logs
for run in "${runs[@]}"; do
    [ "$(state "$run")" != open ] || start "$run"
done
[ -z "$signalled" ] || send "$signalled" # to runs that started after the signal
until wait; do # a signal interrupts wait
    patience=$((SECONDS + 270))
    while computing && ((SECONDS < patience)); do
        sleep 1
    done
    send TERM
done

finished=0 failed=0 open=0 progress=no
for run in "${runs[@]}"; do
    case $(state "$run") in
    finished) finished=$((finished + 1)) ;;
    failed) failed=$((failed + 1)) ;;
    *) open=$((open + 1)) ;;
    esac
    for file in checkpoint.zip done.json; do
        [ ! "runs/$run/$file" -nt "$began" ] || progress=yes
    done
done
echo "task $task: $finished finished, $failed failed, $open not finished${signalled:+, ended by $signalled}"
if [ "$signalled" = USR1 ] && [ "$open" -gt 0 ]; then
    if [ "$progress" = no ]; then
        echo "task $task: not queued again: no run reached a checkpoint; ask for more --time" >&2
    elif ((${SLURM_RESTART_COUNT:-0} >= 3)); then
        echo "task $task: not queued again: it was queued again 3 times; continue with smarticles resume" >&2
    else
        echo "task $task: queued again"
        # The number of the array's last task is that of the whole array, of which Slurm would queue every task anew.
        scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
        exit 0
    fi
fi
[ $((failed + open)) -eq 0 ]
