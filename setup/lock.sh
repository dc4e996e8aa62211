#!/usr/bin/env bash
# Regenerate the pins in requirements.txt, requirements-dev.txt and requirements-bench.txt from pyproject.toml.
#
# Nothing is installed: pip reads the metadata of most packages from the index, which saves downloads of 2 GB.
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

wanted() { # EXTRA …: the requirements of extras, and of the project itself for "core", one a line
    "${python[@]}" - "$@" <<'PYTHON'
import sys
import tomllib

with open("pyproject.toml", "rb") as file:
    project = tomllib.load(file)["project"]
lists = {"core": project["dependencies"], **project["optional-dependencies"]}
names = [one for extra in sys.argv[1:] for one in lists[extra] if not one.startswith("smarticles[")]
print("\n".join(names))
PYTHON
}

wanted core viz view export arrays calibrate >"$scratch/run.in"
wanted docs dev >"$scratch/dev.in"
wanted bench >"$scratch/bench.in"
pins run setuptools -r "$scratch/run.in"
pins all -r "$scratch/run" -r "$scratch/dev.in"
pins bench -r "$scratch/all" -r "$scratch/bench.in"

added() { comm -13 <(sort "$scratch/$1") <(sort "$scratch/$2") | sort -f; }

{
    echo "# Made by 'make lock' from pyproject.toml; setuptools builds the project itself."
    cat "$scratch/run"
} >requirements.txt
{
    echo "# Made by 'make lock' from pyproject.toml; used together with requirements.txt."
    added run all
} >requirements-dev.txt
{
    echo "# Made by 'make lock' from pyproject.toml; used together with requirements.txt, by 'make rivals' alone."
    added all bench
} >requirements-bench.txt
