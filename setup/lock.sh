#!/usr/bin/env bash
# Regenerate the pins in requirements.txt, requirements-dev.txt and requirements-bench.txt from the .in files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

/usr/bin/python3 -m venv "$scratch/venv"
pip=("$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check --no-input)
pins() { "${pip[@]}" freeze --all --exclude pip | sort -f; }

"${pip[@]}" install --upgrade setuptools -r requirements.in
pins >"$scratch/run"
"${pip[@]}" install -r "$scratch/run" -r requirements-dev.in
pins >"$scratch/all"
"${pip[@]}" install -r "$scratch/all" -r requirements-bench.in
pins >"$scratch/bench"

{
    echo "# Made by 'make lock' from requirements.in; setuptools builds the project itself."
    cat "$scratch/run"
} >requirements.txt
{
    echo "# Made by 'make lock' from requirements-dev.in; used together with requirements.txt."
    comm -13 <(sort "$scratch/run") <(sort "$scratch/all") | sort -f
} >requirements-dev.txt

{
    echo "# Made by 'make lock' from requirements-bench.in; used together with requirements.txt, by 'make rivals' alone."
    comm -13 <(sort "$scratch/all") <(sort "$scratch/bench") | sort -f
} >requirements-bench.txt
