#!/usr/bin/env bash
# Makes src/report/html/assets/three/three.min.js.gz anew: three.js as far as entry.js beside it asks for,
# minified. Only for a change of version; needs npm and the network. The same versions give the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."

three=0.187.0
three_sri=sha512-Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA==
esbuild=0.28.2

target=$PWD/src/report/html/assets/three
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
cp "$target/entry.js" "$work"
cd "$work"

npm pack --silent "three@$three" >/dev/null
found=sha512-$(openssl dgst -sha512 -binary "three-$three.tgz" | base64 -w0)
if [ "$found" != "$three_sri" ]; then
  echo "vendor: three-$three.tgz has the integrity $found" >&2
  exit 1
fi
# npm checks the bundler against the registry's own record.
npm install --silent --no-audit --no-fund --ignore-scripts "./three-$three.tgz" "esbuild@$esbuild"
node_modules/.bin/esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2022 \
  --legal-comments=none --banner:js="/* three.js $three, MIT License, Copyright three.js authors */" \
  --outfile=three.min.js --log-level=warning
gzip -9n three.min.js
cp three.min.js.gz "$target"
cp node_modules/three/LICENSE "$target"
ls -l "$target"
