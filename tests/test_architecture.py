"""Checks that ruff, mypy and import-linter lack: floats in normative code, sizes, kernels."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "quarc_ref"
MODULES = sorted(PACKAGE.rglob("*.py"))
KERNELS = [path for path in MODULES if path.name.endswith("kernels.py")]


def _in_rooms(*rooms):
    return [path for path in MODULES if path.relative_to(PACKAGE).parts[0] in rooms]


NORMATIVE = _in_rooms("format", "decoder", "streams")
LIGHT = [*NORMATIVE, *_in_rooms("playback", "inspection", "conformance")]
HEAVY = ("torch", "gsplat", "cv2", "av", "pycolmap", "numba", "scipy", "matplotlib", "PIL")

# The floats that SPEC allows: no decision depends on them.
ALLOWED_FLOATS = {
    # Seconds to wait for a writer or a server, which are not part of any state (SPEC 11.2, 11.3).
    "streams/follow.py": {"literal", "float"},
    "streams/http_source.py": {"literal", "float"},
    "streams/http_client.py": {"float"},
    "streams/timed_connection.py": {"float"},
    # One rounding of the finished state, which affects no later state (SPEC 10.1).
    "decoder/dequantize.py": {"literal", "float", "float32", "Float32"},
    # An estimate of a root or quotient, corrected by integer comparisons (SPEC 4.2, 4.3).
    "format/arithmetic.py": {"sqrt", "float64"},
    # NEAR_FRACTION, only for pictures (SPEC 10.3).
    "format/constants.py": {"literal"},
    # constriction takes its integer weights as doubles, which are exact (SPEC 8.3).
    "format/coding/entropy.py": {"float64"},
    # Only the writer's choice, which readers accept in any case (SPEC 8.1).
    "format/coding/pricing.py": {"log2", "division"},
    # Steps, time base and cameras: fields that are not used in computations (SPEC 5.3, 5.6).
    "format/cameras.py": {"float", "math"},
    "format/layouts.py": {"Float32l"},
    "format/records.py": {"literal", "float", "division", "<f4"},
    # The same fields in bytes.
}

_FLOAT_FUNCTIONS = {
    *("mean", "average", "median", "std", "var", "percentile", "quantile", "linspace"),
    *("sqrt", "cbrt", "exp", "exp2", "log", "log2", "log10", "log1p", "expm1", "power", "hypot"),
    *("round", "rint", "around", "true_divide", "divide", "reciprocal", "random", "complex"),
    *("sin", "cos", "tan", "arctan2", "float_power", "double", "single", "half", "floating"),
}
_FLOAT_MODULES = {"math", "cmath", "random", "statistics", "decimal", "fractions"}
_FLOAT_DTYPE = re.compile(r"[<>=]?(f[248]|[efdg]|float\d*|double|c8|c16)")


def _name(path):
    return path.relative_to(PACKAGE).as_posix()


def _parse(path):
    return ast.parse(path.read_text("utf-8"))


def _constant_floats(node):
    if isinstance(node.value, float | complex):
        yield "literal"
    if isinstance(node.value, str) and _FLOAT_DTYPE.fullmatch(node.value):
        yield node.value


def _division_floats(node):
    # In `layouts`, "name" / Int8ul names a field in construct's notation.
    left = node.left if isinstance(node, ast.BinOp) else node.target
    names_a_field = isinstance(left, ast.Constant) and isinstance(left.value, str)
    if isinstance(node.op, ast.Div) and not names_a_field:
        yield "division"


def _named_floats(name):
    if name in _FLOAT_FUNCTIONS or re.fullmatch(r"c?[Ff]loat\d*[lbn]?", name):
        yield name


def _imported_floats(node):
    if isinstance(node, ast.ImportFrom) and node.module in _FLOAT_MODULES:
        yield node.module
    for alias in node.names:
        if alias.name in _FLOAT_MODULES:
            yield alias.name
        yield from _named_floats(alias.name)


_FINDERS = {
    ast.Constant: _constant_floats,
    ast.BinOp: _division_floats,
    ast.AugAssign: _division_floats,
    ast.Name: lambda node: _named_floats(node.id),
    ast.Attribute: lambda node: _named_floats(node.attr),
    ast.Import: _imported_floats,
    ast.ImportFrom: _imported_floats,
}


def find_floats(tree):
    """The kinds of floating-point numbers in a module."""
    found = (_FINDERS[type(node)](node) for node in ast.walk(tree) if type(node) in _FINDERS)
    return {kind for kinds in found for kind in kinds}


@pytest.mark.parametrize("path", NORMATIVE, ids=_name)
def test_normative_code_has_no_floats_except_those_of_the_spec(path):
    assert find_floats(_parse(path)) == ALLOWED_FLOATS.get(_name(path), set())


def test_every_file_that_may_contain_floats_exists():
    assert ALLOWED_FLOATS.keys() <= {_name(path) for path in NORMATIVE}


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        ("x = 0.5", "literal"),
        ("x = 1j", "literal"),
        ("x = a / b", "division"),
        ("x /= 2", "division"),
        ("x = float(a)", "float"),
        ("x: float = 1", "float"),
        ("x = round(a)", "round"),
        ("x = np.float32(a)", "float32"),
        ("x = a.astype('<f4')", "<f4"),
        ("x = np.zeros(3, dtype='f8')", "f8"),
        ("x = a.mean()", "mean"),
        ("x = np.sqrt(a)", "sqrt"),
        ("import math", "math"),
        ("from math import floor", "math"),
        ("from construct import Float64b", "Float64b"),
        ("x = ('name' / Int8ul, 7 // 2, 1 << 3, 'i4', 'format')", None),
    ],
)
def test_every_kind_of_float_is_found(code, kind):
    assert find_floats(ast.parse(code)) == ({kind} if kind else set())


def test_modules_are_small():
    sizes = {_name(path): len(path.read_text("utf-8").splitlines()) for path in MODULES}

    assert {name: size for name, size in sizes.items() if size > 320} == {}
    large = [name for name, size in sizes.items() if size > 250]
    assert len(large) <= len(sizes) / 20


def _list_long_functions(path, most):
    for node in ast.walk(_parse(path)):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            if body and body[-1].end_lineno - body[0].lineno + 1 > most:
                yield f"{_name(path)}: {node.name}"


def test_functions_are_short_except_kernels():
    modules = [path for path in MODULES if path not in KERNELS]

    assert [long for path in modules for long in _list_long_functions(path, 40)] == []


def _list_imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


def test_only_kernels_and_their_compiler_import_numba():
    importers = {
        path
        for path in MODULES
        if any(name.split(".")[0] == "numba" for name in _list_imports(_parse(path)))
    }

    assert {path for path in importers if path.name != "compiled.py"} <= set(KERNELS)
    assert importers


@pytest.mark.parametrize("path", KERNELS, ids=_name)
def test_kernels_import_only_numerical_modules_and_kernels(path):
    others = [
        name
        for name in _list_imports(_parse(path))
        if name.split(".")[0] not in {"math", "numba", "numpy"}
        and not name.endswith(("kernels", ".compiled"))
    ]

    assert others == []


@pytest.mark.parametrize("path", KERNELS, ids=_name)
def test_all_functions_of_kernels_are_compiled_except_those_for_constants(path):
    tree = _parse(path)
    plain = {
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and not node.decorator_list
    }
    constants = [node.value for node in tree.body if isinstance(node, ast.Assign)]
    called = {
        node.func.id
        for constant in constants
        for node in ast.walk(constant)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }

    assert plain <= called
    assert not any(isinstance(node, ast.ClassDef) for node in tree.body)


def test_only_one_module_opens_files_with_ffmpeg():
    opening = re.compile(r"\bav\.(open|CodecContext)\b")
    openers = {_name(path) for path in MODULES if opening.search(path.read_text("utf-8"))}

    assert openers == {"datasets/media.py", "datasets/video_writer.py"}


_WRITING = {"write_bytes", "write_text", "rmtree", "copyfile", "copytree", "mkstemp", "rename"}


def _list_writes(tree):
    """The calls that create, replace or delete files, by name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in _WRITING:
            yield node.attr
        if isinstance(node, ast.Call) and getattr(node.func, "attr", None) == "open":
            modes = [each.value for each in node.args[:1] if isinstance(each, ast.Constant)]
            yield from (str(mode) for mode in modes if re.fullmatch(r"[wxa]b?\+?|r\+b", str(mode)))


def test_only_one_package_writes_files():
    others = [path for path in MODULES if path.parent.name != "files"]
    writers = {_name(path) for path in others if any(_list_writes(_parse(path)))}

    assert writers == set()
    assert any(_list_writes(_parse(PACKAGE / "files" / "folders.py")))
    assert list(_list_writes(ast.parse("Path('a').open('wb'); Path('b').write_bytes(b'')")))


def test_the_package_itself_imports_nothing():
    assert list(_list_imports(_parse(PACKAGE / "__init__.py"))) == []


def test_decoding_and_inspection_load_without_heavy_packages():
    names = [
        "quarc_ref." + _name(path).removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        for path in LIGHT
        if path.name != "__main__.py"
    ]
    blocking = "".join(f"sys.modules[{name!r}] = None\n" for name in HEAVY)
    program = "import sys\n" + blocking + "".join(f"import {name}\n" for name in names)

    subprocess.run([sys.executable, "-c", program], check=True)
