#!/usr/bin/env bash
# The report's page in Chromium: `test.sh DIR` writes pages of made-up runs into DIR and tests them, and with them DIR/demo.html, the report of
# the demo, where it is there.
set -euo pipefail
mkdir -p "$1"
pages=$(cd "$1" && pwd)
cd "$(dirname "$0")"

[[ -d node_modules/playwright-core ]] || npm ci --ignore-scripts --no-audit --no-fund --silent
cargo run --quiet --locked -p report --example pages -- "$pages"
PAGES=$pages node --test tests/page.test.mjs
