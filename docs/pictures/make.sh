#!/usr/bin/env bash
# Makes the screenshot of the demo's report page that the README shows. Needs chromium.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo run --release --locked -- demo --output "$work" --report "$work/page.html"
# The moment worth showing: the crosswalk ahead is taken, and one rejected candidate is looked at.
sed -i 's|</body>|<script>{ const s = document.getElementById("slider"); s.value = 30; s.dispatchEvent(new Event("input")); [...document.querySelectorAll("#candidates [role=option]")].find((o) => o.textContent.includes("crosswalk"))?.click(); }</script></body>|' "$work/page.html"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1400,900 \
  --user-data-dir="$work/profile" --screenshot=docs/pictures/demo.png "file://$work/page.html"
