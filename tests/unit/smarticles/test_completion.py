"""--completion: the script completes words in a real bash."""

import subprocess
from pathlib import Path

import pytest
from command_cases import Smarticles

ASK = """
source {script}
function=$(complete -p smarticles | sed 's/.*-F \\([^ ]*\\).*/\\1/')
COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMPREPLY=(); $function
echo "${{COMPREPLY[*]}}"
"""


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("smarticles compa", "compare"),
        ("smarticles study colla", "collapse"),
        ("smarticles run scene.yaml --eng", "--engine"),
        ("smarticles run scene.yaml --engine la", "lammps"),
        ("smarticles init cas", "casting"),
        ("smarticles run sce", "scene.yaml"),
    ],
)
def test_words_are_completed(words: str, meant: str, tmp_path: Path, smarticles: Smarticles) -> None:
    script = tmp_path / "completion.bash"
    script.write_text(smarticles("--completion", "bash").out)
    (tmp_path / "scene.yaml").touch()
    ask = ASK.format(script=script, words=words)
    said = subprocess.run(["bash", "-c", ask], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert (said.stdout.split(), said.stderr) == ([meant], "")
