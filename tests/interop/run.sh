#!/usr/bin/env bash
# Runs peer.py, a node of another DDS implementation, with the arguments given: see there. Without arguments it only
# makes sure that it could.
# Exit code 77: python3 or the packages cannot be had here.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
name=interop
. "$here/../environment.sh"

[ $# -gt 0 ] || exit 0
export PYTHONDONTWRITEBYTECODE=1
exec "$python" "$here/peer.py" "$@"
