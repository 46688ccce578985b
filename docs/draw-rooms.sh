#!/bin/sh
# Draws docs/rooms.svg: which room includes which. What one gets through another has no arrow of its own. Usage: draw-rooms.sh, from the
# project's folder, where Graphviz (dot, tred) is installed.
set -eu
{
  echo 'digraph rooms {'
  echo '  graph [rankdir=BT, ranksep=0.45, nodesep=0.35]; edge [color="#3b4a5a", arrowsize=0.7];'
  echo '  node [shape=box, style="rounded,filled", fillcolor="#eef2f6", color="#3b4a5a", fontname="DejaVu Sans", fontsize=12];'
  echo '  core [fillcolor="#e3f1e3"]; models [fillcolor="#e3f1e3"]; protocols [fillcolor="#e3f1e3"]; rounds [fillcolor="#e3f1e3"];'
  grep -rE '^#include ["<][a-z]+/[^">]+[">]' --include='*.?pp' \
    agent core dds idl io models orchestrator plant process protocols rounds |
    awk -F '[:"<>]' '
      function room(path, part) { split(path, part, "/"); return part[1] == "orchestrator" ? part[1] "/" part[2] : part[1] }
      $3 != "dds/dds.h" && room($1) != room($3) { print "  \"" room($1) "\" -> \"" room($3) "\";" }' |
    grep -E -- '-> "(agent|core|dds|idl|io|models|orchestrator/[a-z]+|plant|process|protocols|rounds)"' | sort -u
  echo '}'
} | tred | dot -Tsvg > docs/rooms.svg
