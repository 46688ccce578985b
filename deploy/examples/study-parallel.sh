#!/bin/sh
# The cells of a study through GNU parallel: study-parallel.sh study.yaml study [options of parallel, such as --sshloginfile hosts]
# Hosts that parallel reaches need the folder under the same name, and consort on the path.
set -e
file=$1 folder=$2
shift 2
[ -e "$folder/plan.json" ] || consort run "$file" --output "$folder" --plan --quiet
seq "$(grep -c '"cell":' "$folder/plan.json")" | parallel "$@" consort run --resume "$folder" --cell {} --quiet || true
exec consort collect "$folder"
