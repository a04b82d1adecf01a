#!/usr/bin/env bash
# Reads OUT.mcap back with two programs that are not ours: see readback.py.
# Exit code 0: read and equal; 1: not; 2: wrong use; 77: python3 or the packages cannot be had here.
set -euo pipefail

[ $# -eq 1 ] || { echo "usage: run.sh OUT.mcap" >&2; exit 2; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
name=readback
. "$here/../environment.sh"

exec "$python" "$here/readback.py" "$1"
