#!/usr/bin/env bash
# The report's page in Chromium: `test.sh DIR` writes pages of made-up runs into DIR and tests them, and with them DIR/demo.html, the report of
# the demo, where it is there.
set -euo pipefail
mkdir -p "$1"
pages=$(cd "$1" && pwd)
cd "$(dirname "$0")"

[[ -d node_modules/playwright-core ]] || npm ci --ignore-scripts --no-audit --no-fund --silent
# With the tests' features, of which all packages are built already.
cargo build --quiet --locked -p report -p stillmap-tests --example pages
"${CARGO_TARGET_DIR:-../../../target}/debug/examples/pages" "$pages"
PAGES=$pages node --test tests/page.test.mjs
