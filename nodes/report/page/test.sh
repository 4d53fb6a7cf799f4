#!/usr/bin/env bash
# The pages in Chromium: `test.sh DIR` writes report pages of made-up runs into DIR and tests them, with them DIR/demo.html, the report of the demo,
# where it is there, and the live view of a made-up graph. `SLOW_FRAMES_MS=300 test.sh DIR` is the same on a machine whose frames take so
# long: the tests pass on any.
set -euo pipefail
mkdir -p "$1"
pages=$(cd "$1" && pwd)
cd "$(dirname "$0")"

[[ -d node_modules/playwright-core ]] || npm ci --prefer-offline --fetch-retries=5 --ignore-scripts --no-audit --no-fund --silent
# With the tests' features, of which all packages are built already.
cargo build --quiet --locked -p report -p live-view -p stillmap-tests --example pages --example made_up
examples=${CARGO_TARGET_DIR:-$PWD/../../../target}/debug/examples
"$examples/pages" "$pages"
PAGES=$pages MADE_UP=$examples/made_up node --test tests/{detail,ceiling,live_map,page,live}.test.mjs
