#!/bin/sh
# Starts detection, segmentation and reconstruction on a machine without ROS, and ends them together.
# See --help.
#
# Each node gets a SIGTERM when this script is told to end, and SIGKILL when it has not ended in time.
set -u

usage() {
    cat <<'USAGE'
Starts the nodes detection, segmentation and reconstruction, and ends all three together: on Ctrl-C,
SIGTERM or SIGHUP, or when one of them ends.

Usage: up.sh [--rig PRESET] [ROS ARGUMENTS]...

  --rig PRESET   a preset of config/rig, or the path of a parameter file
                 [default: rplidar_a1_kinect_v1]
  -h, --help     print this help

Everything else goes to all three nodes as ROS arguments, and wins over the files of config/. A
parameter is known to its own node only, which therefore stands before it.

Example:
  up.sh -r scan:=/laser/scan -r __ns:=/robot -p reconstruction:map_file:=map.ply

Environment:
  STILLMAP       the program `stillmap` [default: the one on the PATH, then target/release/stillmap]
  ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE   as everywhere in ROS 2

Exit code: 0 when the nodes were told to end and did; otherwise that of the first node that failed, or 1.
USAGE
}

fail() { # CODE MESSAGE
    echo "up.sh: $2" >&2
    exit "$1"
}

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd) || exit 1
nodes='detection segmentation reconstruction'
rig=rplidar_a1_kinect_v1
poll_s=0.5
# A node that does not end within 10 s of being told is killed.
grace_polls=20

# What is not for this script moves behind what is left, so that it keeps its words and its order.
left=$#
while [ "$left" -gt 0 ]; do
    argument=$1
    shift
    left=$((left - 1))
    case $argument in
        -h | --help)
            usage
            exit 0
            ;;
        --rig)
            [ "$left" -gt 0 ] || fail 2 '--rig must be followed by a preset; see --help'
            rig=$1
            shift
            left=$((left - 1))
            ;;
        --rig=*) rig=${argument#--rig=} ;;
        *) set -- "$@" "$argument" ;;
    esac
done

case $rig in
    */* | *.yaml) rig_file=$rig ;;
    *) rig_file=$root/config/rig/$rig.yaml ;;
esac
[ -r "$rig_file" ] || fail 2 "there is no rig preset $rig_file; the presets are the files of $root/config/rig"

stillmap=${STILLMAP:-$(command -v stillmap || echo "$root/target/release/stillmap")}
command -v "$stillmap" >/dev/null ||
    fail 1 "there is no program $stillmap; build it: cargo build --release, or set STILLMAP to its path"

# A process group of its own for each node: a Ctrl-C at the terminal reaches this script alone, which
# hands it on once.
own_group=setsid
if ! command -v setsid >/dev/null; then
    own_group=
    set -m
fi

asked=0
trap 'asked=$((asked + 1))' INT TERM HUP

pids=
for node in $nodes; do
    $own_group "$stillmap" node "$node" --ros-args --params-file "$root/config/pipeline.yaml" \
        --params-file "$root/config/$node.yaml" \
        --params-file "$rig_file" "$@" &
    pids="$pids $!"
done
set +m

count_running() { # into `running`; the names of the others into `ended`
    running=0
    ended=
    # shellcheck disable=SC2086 # one word for each process
    set -- $pids
    for node in $nodes; do
        if kill -0 "$1" 2>/dev/null; then running=$((running + 1)); else ended="$ended $node"; fi
        shift
    done
}
signal_nodes() { # SIGNAL
    # Those that have ended already cannot be signalled, and need not be.
    for pid in $pids; do kill -s "$1" "$pid" 2>/dev/null; done
}

all=$(echo "$nodes" | wc -w)
count_running
while [ "$asked" -eq 0 ] && [ "$running" -eq "$all" ]; do
    sleep "$poll_s"
    count_running
done
told=$asked

[ "$asked" -gt 0 ] || echo "up.sh: ended by itself:$ended; ending the others" >&2
signal_nodes TERM
polls=0
count_running
while [ "$running" -gt 0 ]; do
    [ "$polls" -lt "$grace_polls" ] || signal_nodes KILL
    sleep "$poll_s"
    polls=$((polls + 1))
    count_running
done

# 143 is a node that was told to end before it could listen: that is no failure of its own.
status=0
# shellcheck disable=SC2086 # one word for each process
set -- $pids
for node in $nodes; do
    wait "$1"
    code=$?
    shift
    [ "$code" -eq 0 ] || [ "$code" -eq 143 ] && continue
    echo "up.sh: $node ended with exit code $code" >&2
    [ "$status" -ne 0 ] || status=$code
done
[ "$told" -gt 0 ] || [ "$status" -ne 0 ] || status=1
exit "$status"
