#!/bin/sh
# Installs the Debian packages of deploy/packages.txt that are missing. Silent, and done in milliseconds, when nothing is.
# Usage: deploy/setup.sh [--check] [--list FILE]
#   --check: only say what is missing (exit 1 if anything is)    --list: another list of packages
set -eu
list=$(dirname "$0")/packages.txt
check=
while [ $# -gt 0 ]; do
  case "$1" in
    --check) check=yes ;;
    --list) list=$2 && shift ;;
    *) echo "setup: unknown option $1" >&2 && exit 2 ;;
  esac
  shift
done
wanted=$(sed -e 's/#.*//' "$list" | tr -s '[:space:]' ' ')

fail() {
  printf 'setup: %s\n' "$@" >&2
  exit 1
}

if ! command -v dpkg-query >/dev/null 2>&1 || ! command -v apt-get >/dev/null 2>&1; then
  fail "this machine has no dpkg/apt-get; Consort's set-up knows Debian 12 and its relatives only." \
    "Install the equivalents of these packages yourself, then say 'make SETUP=no run':" "  $wanted"
fi

# shellcheck disable=SC2086  # the list is meant to be split
installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' $wanted 2>/dev/null | sed -n 's/^installed //p' | tr '\n' ' ')
missing=
for package in $wanted; do
  case " $installed " in *" $package "*) ;; *) missing="$missing $package" ;; esac
done
missing=${missing# }
[ -n "$missing" ] || exit 0
if [ -n "$check" ]; then fail "missing: $missing"; fi

if [ "$(id -u)" = 0 ]; then
  as_root=
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
  as_root='sudo -n'
elif command -v sudo >/dev/null 2>&1 && [ -t 0 ]; then
  echo "setup: sudo may ask for your password"
  as_root=sudo
else
  fail "these packages are missing: $missing" "and this user may not install them (neither root nor sudo). Ask an administrator to run:" \
    "  apt-get update && apt-get install -y --no-install-recommends $missing"
fi

echo "setup: installing $missing"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
quietly() {
  # shellcheck disable=SC2086
  if ! $as_root env DEBIAN_FRONTEND=noninteractive "$@" >"$log" 2>&1 </dev/null; then
    tail -n 20 "$log" >&2
    fail "failed: $*" "remedy: see that the network and /etc/apt/sources.list work (Debian 12 'bookworm', section main), then repeat"
  fi
}
quietly apt-get -o DPkg::Lock::Timeout=120 update
# shellcheck disable=SC2086
quietly apt-get -o DPkg::Lock::Timeout=120 install -y --no-install-recommends $missing
echo "setup: done"
