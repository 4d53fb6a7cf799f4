#!/usr/bin/env bash
# Bundles the sources of the page into bundle.js, which is checked in: building the workspace needs no Node.js. With --check it compares
# instead. The same sources and versions (package-lock.json) give the same bytes.
set -euo pipefail
cd "$(dirname "$0")"

npm ci --prefer-offline --fetch-retries=5 --ignore-scripts --no-audit --no-fund --silent
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
node_modules/.bin/esbuild src/main.js --bundle --minify --format=iife --target=es2022 --charset=utf8 --legal-comments=inline \
    --log-level=warning --outfile="$made/bundle.js"
# The Content-Security-Policy of the page allows this script alone, by this hash.
node -e 'const { createHash } = require("node:crypto"), { readFileSync, writeFileSync } = require("node:fs");
const [bundle, hash] = process.argv.slice(1);
writeFileSync(hash, `sha256-${createHash("sha256").update(readFileSync(bundle)).digest("base64")}`);' "$made/bundle.js" "$made/bundle.hash"

for file in bundle.js bundle.hash; do
    if [[ ${1:-} == --check ]]; then
        cmp "$made/$file" "$file" || { echo "nodes/report/page/$file is not what build.sh makes of its sources" >&2; exit 1; }
    else
        cp "$made/$file" "$file"
    fi
done
