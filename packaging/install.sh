#!/bin/sh
# Lays the program out as a package of ROS 2, so that `ros2 run` and `ros2 launch` find it.
#
#   packaging/install.sh [--prefix DIR] [--binary FILE]
#
# The prefix is where it will run; DESTDIR is put before it while files are copied. Nothing is removed.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
prefix=/opt/trajectory_selector
binary=$root/target/release/trajectory-selector

fail() {
  printf 'install.sh: %s\n' "$1" >&2
  exit 2
}

while [ $# -gt 0 ]; do
  case $1 in
    --prefix | --binary) [ $# -ge 2 ] || fail "$1 needs a value" ;;
    *) fail "unknown argument: $1" ;;
  esac
  case $1 in
    --prefix) prefix=$2 ;;
    --binary) binary=$2 ;;
  esac
  shift 2
done

case $prefix in
  /*) ;;
  *) fail "the prefix must be an absolute path: $prefix" ;;
esac
case $prefix in
  *[!A-Za-z0-9/._+-]*) fail "the prefix may have letters, digits and / . _ + - only: $prefix" ;;
esac
prefix=${prefix%/}
[ -x "$binary" ] || fail "no program at $binary: build it with \`cargo build --release\`, or name it with --binary"
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' "$root/Cargo.toml" | head -n 1)
[ -n "$version" ] || fail "no version in $root/Cargo.toml"

package=trajectory_selector
to=${DESTDIR:-}$prefix
share=$to/share/$package

# put MODE FROM TO: a copy, with the placeholders filled in
put() {
  mkdir -p "$(dirname -- "$3")"
  sed -e "s|@PREFIX@|$prefix|g" -e "s|@VERSION@|$version|g" "$2" >"$3.new"
  chmod "$1" "$3.new"
  mv -f "$3.new" "$3"
}

mkdir -p "$to/bin"
# A running program must not be written over; the name is given to the new file instead.
cp -- "$binary" "$to/bin/trajectory-selector.new"
chmod 755 "$to/bin/trajectory-selector.new"
mv -f "$to/bin/trajectory-selector.new" "$to/bin/trajectory-selector"

put 755 "$root/packaging/trajectory_selector_node" "$to/lib/$package/trajectory_selector_node"
put 644 "$root/packaging/package.xml" "$share/package.xml"
put 644 "$root/packaging/local_setup.sh" "$share/local_setup.sh"
put 644 "$root/LICENSE" "$share/LICENSE"
for file in "$root"/launch/*.launch.xml; do
  put 644 "$file" "$share/launch/${file##*/}"
done
for file in "$root"/config/*.param.yaml "$root"/config/parking/*.param.yaml; do
  put 644 "$file" "$share/config/${file##*/}"
done
for file in "$root"/config/schema/*.schema.json; do
  put 644 "$file" "$share/schema/${file##*/}"
done

# The marker by which ament knows that the package is here.
mkdir -p "$to/share/ament_index/resource_index/packages"
: >"$to/share/ament_index/resource_index/packages/$package"

put 644 "$root/packaging/trajectory-selector.service" "$to/lib/systemd/system/trajectory-selector.service"
put 644 "$root/packaging/60-trajectory-selector.conf" "$to/lib/sysctl.d/60-trajectory-selector.conf"

printf 'installed in %s\n' "$to"
case :${AMENT_PREFIX_PATH:-}: in
  *:"$prefix":*) ;;
  *) printf 'for ROS 2: . %s\n' "$prefix/share/$package/local_setup.sh" ;;
esac
