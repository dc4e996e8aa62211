#!/usr/bin/env bash
# Regenerate the pins in requirements.txt, requirements-dev.txt and requirements-bench.txt from the .in files.
#
# Nothing is installed: a pip that reads what the index tells of a package needs the packages themselves of few. An
# installation downloads and unpacks 2 GB besides, to learn no more.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

/usr/bin/python3 -m venv "$scratch/venv"
python=("$scratch/venv/bin/python")
pip=("${python[@]}" -m pip -qq --disable-pip-version-check --no-input)
# Debian's own downloads all that it would install.
"${pip[@]}" install --upgrade pip

pins() { # NAME, then what pip takes: all that would be installed, one NAME==VERSION a line
    local name=$1
    shift
    "${pip[@]}" install --dry-run --ignore-installed --report "$scratch/report.json" "$@"
    "${python[@]}" - "$scratch/report.json" >"$scratch/$name" <<'PYTHON'
import json
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    found = [package["metadata"] for package in json.load(file)["install"]]
print("\n".join(sorted((f"{one['name']}=={one['version']}" for one in found), key=str.casefold)))
PYTHON
    echo "lock: $name, $(wc -l <"$scratch/$name") packages" >&2
}

pins run setuptools -r requirements.in
pins all -r "$scratch/run" -r requirements-dev.in
pins bench -r "$scratch/all" -r requirements-bench.in

added() { comm -13 <(sort "$scratch/$1") <(sort "$scratch/$2") | sort -f; }

{
    echo "# Made by 'make lock' from requirements.in; setuptools builds the project itself."
    cat "$scratch/run"
} >requirements.txt
{
    echo "# Made by 'make lock' from requirements-dev.in; used together with requirements.txt."
    added run all
} >requirements-dev.txt
{
    echo "# Made by 'make lock' from requirements-bench.in; used together with requirements.txt, by 'make rivals' alone."
    added all bench
} >requirements-bench.txt
