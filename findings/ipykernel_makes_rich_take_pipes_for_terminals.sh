#!/usr/bin/env bash
# ipykernel 7.4.0 with rich 15.0.0: in a process that a notebook starts, rich takes pipes and files for terminals.
#
# The kernel puts FORCE_COLOR=1 into its environment, which every process inherits that a cell starts, such as a solver
# or `mpirun`. rich reads it as "this is a terminal": Console(file=…).is_terminal is True for a pipe and a StringIO,
# and live displays write cursor movements and one picture after another into logs that nobody sees as a screen. isatty()
# says False all the while, and the same program started from a shell writes plain lines.
#
# Seen on 2026-11-28:
#   FORCE_COLOR in the kernel: 1
#   isatty of the pipe: False, rich: True
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install ipykernel==7.4.0 nbclient==0.11.0 rich==15.0.0
cd "$scratch"
env -u FORCE_COLOR venv/bin/python - <<'PYTHON' | tee said
import nbformat
from nbclient import NotebookClient

CELL = '''
import os, subprocess, sys
print("FORCE_COLOR in the kernel:", os.environ.get("FORCE_COLOR"))
code = "import sys; from rich.console import Console; print(f'isatty of the pipe: {sys.stdout.isatty()}, rich: {Console().is_terminal}')"
print(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout)
'''
notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
NotebookClient(notebook, kernel_name="python3", timeout=120).execute()
print("".join(output.get("text", "") for output in notebook.cells[0].outputs).strip())
PYTHON
grep -qx "FORCE_COLOR in the kernel: 1" said
grep -qx "isatty of the pipe: False, rich: True" said
echo "as described"
