#!/bin/sh
# Writes what an installation has beside the programs and is made by them: manual pages of their help, completion of shells.
# Usage: deploy/manual.sh BIN OUTPUT VERSION     writes OUTPUT/man1/*.1.gz and OUTPUT/{bash,zsh,fish}
set -eu
bin=$1 out=$2 version=$3
rm -rf "$out"
mkdir -p "$out/man1" "$out/bash" "$out/zsh" "$out/fish"

# Help as a page of man: a line in capitals is a section, others stand as they are. What does not begin with NAME gets it from its first
# sentence.
page() {
  title=$1 && shift
  "$@" --help | awk -v title="$title" -v version="$version" '
    function text(line) {
      gsub(/\\/, "\\e", line)
      gsub(/-/, "\\-", line)
      return line ~ /^[.\x27]/ ? "\\&" line : line
    }
    function section(name) {
      print (open ? ".fi\n" : "") ".SH " name "\n.nf"
      open = 1
    }
    NR == 1 {
      print ".TH " toupper(title) " 1 \"\" \"Consort " version "\""
      if ($0 != "NAME") {
        what = tolower(substr($0, 1, 1)) substr($0, 2)
        sub(/[:.].*/, "", what)
        print ".SH NAME\n" title " \\- " text(what)
        section("DESCRIPTION")
      } else {
        print ".SH NAME"
        named = 1
        next
      }
    }
    named && /^ / {
      sub(/^ *.* - /, "")
      line = text($0)
      sub(/^ */, "", line)
      printf "%s%s", (named == 1 ? title " \\- " : " "), line
      named++
      next
    }
    named { print ""; named = 0 }
    /^Usage: / { section("SYNOPSIS"); sub(/^Usage: /, ""); print text($0); next }
    /^Options:$/ { section("OPTIONS"); next }
    /^[A-Z][A-Z ]*$/ { section($0); next }
    { sub(/^    /, ""); if ($0 != "" || open) print text($0) }
    END { print ".fi" }' | gzip -9n >"$out/man1/$title.1.gz"
}

page consort "$bin/consort"
for verb in $("$bin/consort" --help | awk '/^[A-Z]/ { verbs = $0 == "VERBS" } verbs && /^    [a-z]/ { print $1 }'); do
  page "consort-$verb" "$bin/consort" "$verb"
done
page consort-agent "$bin/consort-agent"
page consort-plant "$bin/consort-plant"

"$bin/consort" completion bash >"$out/bash/consort"
ln -s consort "$out/bash/consort-agent"
ln -s consort "$out/bash/consort-plant"
"$bin/consort" completion zsh >"$out/zsh/_consort"
"$bin/consort" completion fish >"$out/fish/consort.fish"
ln -s consort.fish "$out/fish/consort-agent.fish"
ln -s consort.fish "$out/fish/consort-plant.fish"
