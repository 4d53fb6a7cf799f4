#!/usr/bin/env bash
# Every kind of page as a user sees it: `pictures.sh DIR [PAGE.html...]` writes pictures of report pages of made-up runs, of the live view of a made-up
# graph, and of the pages that are named, 1300 and 390 pixels wide, light and dark, to be looked at.
set -euo pipefail
mkdir -p "$1"
pictures=$(cd "$1" && pwd)
shift
others=()
for page in "$@"; do others+=("$(realpath "$page")"); done
cd "$(dirname "$0")"

[[ -d node_modules/playwright-core ]] || npm ci --ignore-scripts --no-audit --no-fund --silent
cargo build --quiet --locked -p report -p live-view -p stillmap-tests --example pages --example made_up
examples=${CARGO_TARGET_DIR:-$PWD/../../../target}/debug/examples
pages=$(mktemp -d)
"$examples/pages" "$pages" >/dev/null
export ROS_DOMAIN_ID=$((71 + $$ % 30)) ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
exec {graph}< <(exec "$examples/made_up" 127.0.0.1:0)
made_up=$!
trap 'kill -INT "$made_up"; rm -rf "$pages"' EXIT
read -r url <&"$graph"
node tests/pictures.mjs "$pictures" "$pages"/{room,coloured,meshed,hostile}.html "${others[@]}" "$url"
