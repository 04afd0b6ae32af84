#!/usr/bin/env bash
# usage: check_names.sh ROOT     exits 1 with one line per name that means two things
#
# Sources of one library are compiled in batches, each batch as one file: the anonymous namespaces of a batch are one.
# Which sources share a batch changes with every source that is added, so a name there is a name of its whole library; and
# one that a header of ours declares in the same namespace becomes ambiguous where that header comes in. Functions may share
# a name as long as they take different types: const, references and pointers apart, since what tells only those apart
# fails at the first call that does not say.
#
# Our format makes this simple to read: what a namespace declares begins in the first column, what goes on is indented.
set -euo pipefail
cd "$1"

# "TARGET SOURCE" for each source of each target that CMake compiles.
targets() {
  find . -name CMakeLists.txt -not -path './build/*' -not -path './out/*' -not -path './.*' | LC_ALL=C sort |
    xargs awk '
    FNR == 1 { folder = FILENAME; sub(/CMakeLists\.txt$/, "", folder); sub(/^\.\//, "", folder); target = "" }
    {
      sub(/#.*/, "")
      gsub(/"/, "")
      gsub(/\$\{CMAKE_SOURCE_DIR\}\//, "//")
      if (match($0, /(veneer_add_(library|program|tests|test_main)|target_sources)\([A-Za-z0-9_-]+/)) {
        target = substr($0, RSTART, RLENGTH)
        sub(/.*\(/, "", target)
        $0 = substr($0, RSTART + RLENGTH)
      }
      closes = /\)/
      gsub(/[()]/, " ")
      for (i = 1; i <= NF && target != ""; ++i) {
        if ($i !~ /\.cc$/ || $i ~ /\$/) continue
        print target, ($i ~ /^\/\// ? substr($i, 3) : folder $i)
      }
      if (closes) target = ""
    }'
}

headers() {
  find . -name '*.h' -not -path './build/*' -not -path './out/*' -not -path './.*' | LC_ALL=C sort | sed 's|^\./|- |'
}

{ targets && headers; } | awk '
    function trim(s) { sub(/^[ \t]+/, "", s); sub(/[ \t]+$/, "", s); return s }
    # Takes out the first bracketed part that begins at `from`, nested ones with it.
    function skip_brackets(s, from, open, close_, depth, i, c) {
      depth = 0
      for (i = from; i <= length(s); ++i) {
        c = substr(s, i, 1)
        if (c == open) ++depth
        if (c == close_ && --depth == 0) return i
      }
      return 0
    }
    # Splits at commas that stand in no bracket.
    function split_list(s, part, count, depth, i, c) {
      count = 1
      depth = 0
      part[1] = ""
      for (i = 1; i <= length(s); ++i) {
        c = substr(s, i, 1)
        if (index("(<{[", c)) ++depth
        if (index(")>}]", c) && substr(s, i - 1, 2) != "->") --depth
        if (c == "," && depth == 0) part[++count] = ""
        else part[count] = part[count] c
      }
      return count
    }
    # What a function takes, without names, defaults, const, references and pointers.
    function types_of(s, part, count, i, type, all) {
      all = ""
      count = split_list(s, part)
      for (i = 1; i <= count; ++i) {
        type = part[i]
        sub(/ = .*/, "", type)
        type = trim(type)
        if (type !~ /^[A-Za-z_0-9:]+$/) sub(/[ &*][A-Za-z_0-9]+$/, "", type)
        gsub(/(^| )const( |$)/, " ", type)
        gsub(/[ &*]/, "", type)
        all = all (i > 1 ? "," : "") type
      }
      return all
    }
    # "int a = 1, b = 2": " b".
    function names_after(s, from, part, count, i, all) {
      all = ""
      count = split_list(substr(s, from), part)
      for (i = 2; i <= count; ++i)
        if (match(trim(part[i]), /^[A-Za-z_0-9]+/)) all = all " " substr(trim(part[i]), 1, RLENGTH)
      return all
    }
    # The names that a declaration gives, "" when it gives none here; kind is "function" or "value" or "type".
    function name_of(s, i, c, depth, name, close_) {
      kind = ""
      generic = s ~ /^template/
      while (s ~ /^template *</) {
        close_ = skip_brackets(s, index(s, "<"), "<", ">")
        if (!close_) return "?"
        s = trim(substr(s, close_ + 1))
        if (s == "") return "?"
      }
      gsub(/\[\[[^]]*\]\]/, " ", s)
      sub(/^ +/, "", s)
      if (s ~ /^(using namespace|namespace|static_assert|friend|extern|#|[{}])/ || s ~ /^[A-Z_]+\(/) return ""
      if (s ~ /^(struct|class|union|enum)[ ]/) {
        sub(/^(struct|class|union|enum( class| struct)?) +(alignas\([^)]*\) +)?/, "", s)
        if (s ~ /^[A-Za-z_0-9]+( final)? *(:[^:]|\{)/ || s ~ /^[A-Za-z_0-9]+( final)?$/) {
          match(s, /^[A-Za-z_0-9]+/)
          kind = "type"
          return substr(s, 1, RLENGTH)
        }
        if (s ~ /^[A-Za-z_0-9]+;/) return ""
        if (s ~ /^[A-Za-z_0-9:]+<.*(\{|;)/) return ""   # a specialisation
      }
      if (s ~ /^using /) {
        if (s !~ /=/) return (s ~ /;/) ? "" : "?"
        sub(/^using /, "", s)
        match(s, /^[A-Za-z_0-9]+/)
        kind = "type"
        return substr(s, 1, RLENGTH)
      }
      # The first of ( = { ; [ outside of <...> ends the name.
      depth = 0
      for (i = 1; i <= length(s); ++i) {
        c = substr(s, i, 1)
        if (c == "<") ++depth
        else if (c == ">" && substr(s, i - 1, 1) != "-") --depth
        else if (depth == 0 && index("(={;[", c)) {
          name = trim(substr(s, 1, i - 1))
          if (c == "(" && name ~ /(decltype|alignas|__attribute__|noexcept)$/) {
            i = skip_brackets(s, i, "(", ")")
            if (!i) return "?"
            continue
          }
          if (name ~ /operator/) return ""
          if (name ~ /~/) return ""
          if (!match(name, /[A-Za-z_0-9:]+$/)) return ""
          if (RSTART == 1) return ""                      # no type before it: a macro, a constructor
          name = substr(name, RSTART)
          if (name ~ /:/) return ""                       # a member, defined here
          kind = (c == "(") ? "function" : "value"
          if (kind == "value") return name names_after(s, i)
          close_ = skip_brackets(s, i, "(", ")")
          return close_ ? name "(" (generic ? "..." : types_of(substr(s, i + 1, close_ - i - 1))) ")" : "?"
        }
      }
      return "?"
    }
    function strip(s) {
      gsub(/\\\\/, "", s)
      gsub(/\\"/, "", s)
      gsub(/"[^"]*"/, "\"\"", s)
      gsub(/\047[^\047]\047/, "0", s)
      sub(/\/\/.*/, "", s)
      return s
    }
    # Whether two declarations of one name can stand side by side: functions that take different things can.
    function clash(one, other) { return one !~ /\(/ || other !~ /\(/ || one == other || (one other) ~ /\.\.\./ }
    function declare(found, where, word, count, i, name, key, known) {
      if (found == "") return
      count = found ~ /\(/ ? 1 : split(found, word, " ")
      if (found ~ /\(/) word[1] = found
      for (i = 1; i <= count; ++i) {
        name = word[i]
        sub(/\(.*/, "", name)
        key = space SUBSEP name
        if (header) {
          of_headers[key] = of_headers[key] word[i] "\t" where "\n"
          continue
        }
        all[++names] = key "\n" word[i] "\n" where
        known = of_target[target, key]
        tell_clashes(name, word[i], where, known, "both are in " target)
        of_target[target, key] = known word[i] "\t" where "\n"
      }
    }
    # In `known`, a declaration to a line with the place where it stands.
    function tell_clashes(name, mine, where, known, why, line, count, i, part, its_file) {
      count = split(known, line, "\n")
      for (i = 1; i < count; ++i) {
        split(line[i], part, "\t")
        its_file = part[2]
        sub(/:[0-9]+$/, "", its_file)
        if (index(where, its_file ":") == 1 || !clash(mine, part[1])) continue
        if (its_file ~ /^tests\// && where !~ /^tests\//) continue  # no library includes a test
        if ((name, where, part[2]) in told) continue
        told[name, where, part[2]] = 1
        print where ": " name " is a name of " part[2] " too: " why
        broken = 1
        return
      }
    }
    # What a namespace of the file declares: of a source in anonymous namespaces, of a header outside of them.
    function read(path, line, text, held, at, n, raw, hidden, found, word) {
      space = ""
      held = ""
      n = raw = hidden = 0
      while ((getline line < path) > 0) {
        ++n
        if (raw) {
          raw = line !~ /\)[a-zA-Z]*"/
          continue
        }
        if (line ~ /R"[a-zA-Z]*\(/ && line !~ /R"[a-zA-Z]*\(.*\)[a-zA-Z]*"/) {
          raw = 1
          sub(/R"[a-zA-Z]*\(.*/, "\"\"", line)
        }
        text = strip(line)
        if (text ~ /^(namespace|})/) {
          if (text ~ /^namespace \{/) hidden = 1
          else if (line == "}  // namespace") hidden = 0
          else if (text ~ /^namespace [a-z_:]+ \{/) {
            split(text, word, " ")
            space = word[2]
          }
          held = ""
          continue
        }
        if (hidden == header) continue
        if (text ~ /^[A-Za-z_\[]/ && text !~ /^(public|private|protected):/) {
          if (held == "") at = n
          held = trim(held " " text)
        } else if (held != "" && text ~ /^[ \t]/) {
          held = held " " trim(text)
        } else {
          held = ""
        }
        found = held == "" ? "?" : name_of(held)
        if (found == "?") continue
        declare(found, path ":" at)
        held = ""
      }
      close(path)
    }
    {
      file = $2
      header = ($1 == "-")
      target = $1
      read(file)
    }
    END {
      for (i = 1; i <= names; ++i) {
        split(all[i], part, "\n")
        name = part[1]
        sub(/.*\034/, "", name)
        tell_clashes(name, part[2], part[3], of_headers[part[1]], "a header declares it")
      }
      exit broken + 0
    }'
