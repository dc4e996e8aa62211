"""No BLAS, LAPACK or vectorised function of NumPy decides what is computed: their bits depend on the processor.

`tests/links/test_processors.py` runs scenes as on other processors; here the code is searched.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import dem

FOLDER = Path(dem.__file__).parent
# Of NumPy. Sums, square roots and sums of products by einsum have the same bits everywhere.
FUNCTIONS = {
    *("dot", "matmul", "inner", "vdot", "tensordot", "kron", "convolve", "correlate", "linalg", "polynomial", "fft"),
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh", "exp", "exp2", "expm1"),
    *("log", "log2", "log10", "log1p", "logaddexp", "power", "float_power", "cbrt", "geomspace", "logspace"),
}
ALLOWED = {
    "engine/yade/stable_step.py": "steps are whole parts of an interval, for which the last digits do not count",
    "engine/yade/beams.py": "filaments on YADE, whose bits do depend on the processor",
    "engine/yade/filaments.py": "the same",
    "phases/place.py": "decides whether points lie on a line, far from the threshold",
    "record/kinematics.py": "describes frames, from which nothing goes on",
}


def found(code: str) -> Iterator[str]:
    """What of a module depends on the processor: lines and code."""
    for node in ast.walk(ast.parse(code)):
        match node:
            case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
                bad = True
            case ast.Attribute(value=ast.Name("np"), attr=name):
                bad = name in FUNCTIONS - {"linalg"}
            case ast.Call(func=ast.Attribute(value=ast.Attribute(ast.Name("np"), "linalg"), attr=name), keywords=given):
                bad = not (name == "norm" and any(each.arg == "axis" for each in given))  # of vectors: BLAS
            case ast.Call(func=ast.Attribute(value=ast.Name(), attr="apply")):
                bad = True  # of a rotation
            case ast.ImportFrom(module="scipy.linalg"):
                bad = True
            case _:
                bad = False
        if bad:
            yield f"{getattr(node, 'lineno', 0)}: {ast.unparse(node)}"


def test_no_function_with_bits_of_the_processor_is_used_but_where_it_decides_nothing() -> None:
    by_file = {
        str(path.relative_to(FOLDER)): list(found(path.read_text(encoding="utf-8"))) for path in FOLDER.rglob("*.py")
    }
    used = {name: lines for name, lines in by_file.items() if lines}
    assert {name: lines for name, lines in used.items() if name not in ALLOWED} == {}
    assert set(used) == set(ALLOWED)  # nothing is allowed without need


def test_the_search_finds_each_kind() -> None:
    for code in (
        "a @ b",
        "a @= b",
        "np.dot(a, b)",
        "np.arctan2(a, b)",
        "np.linalg.solve(a, b)",
        "np.linalg.norm(a)",
        "np.polynomial.legendre.leggauss(3)",
        "turn.apply(points)",
        "from scipy.linalg import eigh",
    ):
        assert list(found(code)), code
    assert not list(found("np.linalg.norm(a, axis=1) + math.sin(b) + np.sqrt(c)"))
