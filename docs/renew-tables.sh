#!/bin/sh
# Writes what the tables of protocols, plants and metrics say into the guide and the schema: between "<!-- COMMAND -->" and "<!-- end -->"
# of a page, what that command prints. Usage: renew-tables.sh CONSORT, from the project's folder.
set -eu
consort=$1
for page in docs/guide/*.md; do
  awk -v consort="$consort" '
    /^<!-- end -->$/ { skipping = 0 }
    !skipping { print }
    /^<!-- consort list [a-z]+ --markdown -->$/ {
      command = consort substr($0, 13, length($0) - 16)
      print ""
      while ((command | getline line) > 0) print line
      if (close(command) != 0) exit 1
      print ""
      skipping = 1
    }' "$page" > "$page.new"
  if cmp -s "$page" "$page.new"; then rm "$page.new"; else mv "$page.new" "$page"; fi
done
schema=experiments/experiment.schema.json
{
  sed '/^    "protocol": {$/,$d' "$schema"
  "$consort" list protocols --schema
  sed -n '/^    "relative_sensing": {$/,$p' "$schema"
} > "$schema.new"
mv "$schema.new" "$schema"
