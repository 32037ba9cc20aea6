"""Checks that ruff, mypy and import-linter lack: floats in normative code, file sizes, kernels."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from quarc_ref.decoder.engines import find_fast_engine

PACKAGE = Path(__file__).parents[1] / "quarc_ref"
MODULES = sorted(PACKAGE.rglob("*.py"))
KERNEL_MODULES = [path for path in MODULES if path.name.endswith("kernels.py")]


def _list_modules_in(*package_names):
    return [path for path in MODULES if path.relative_to(PACKAGE).parts[0] in package_names]


NORMATIVE_MODULES = _list_modules_in("format", "decoder", "streams")
LIGHT_MODULES = [*NORMATIVE_MODULES, *_list_modules_in("playback", "inspection", "conformance")]
HEAVY_PACKAGES = ("torch", "gsplat", "cv2", "av", "pycolmap", "numba", "scipy", "matplotlib", "PIL")

# The floats that SPEC allows in each module; the decoded integers do not depend on these floats.
ALLOWED_FLOATS = {
    # Timeouts in seconds for a writer or a server, which change no state (SPEC 11.2, 11.3).
    "streams/follow.py": {"literal", "float"},
    "streams/http_source.py": {"literal", "float"},
    "streams/http_client.py": {"float"},
    "streams/timed_connection.py": {"float"},
    # Dequantization of the finished state, which affects no later state (SPEC 10.1).
    "decoder/dequantize.py": {"literal", "float", "float32", "Float32"},
    # An estimate of a root or quotient, corrected by integer comparisons (SPEC 4.2, 4.3).
    "format/arithmetic.py": {"sqrt", "float64"},
    # SH_C0, SH_C1, NEAR_FRACTION and LOW_PASS, only for pictures (SPEC 10.2, 10.3).
    "format/constants.py": {"literal"},
    # constriction takes its integer weights as doubles, which are exact (SPEC 8.3).
    "format/coding/entropy.py": {"float64"},
    # The writer's choice of probabilities; readers accept every choice (SPEC 8.1).
    "format/coding/pricing.py": {"log2", "division"},
    # Steps, time base and cameras: fields that are not used in computations (SPEC 5.3, 5.6).
    "format/cameras.py": {"float", "math"},
    "format/frame_rate.py": {"literal", "float", "fractions"},
    "format/layouts.py": {"Float32l"},
    "format/records.py": {"literal", "float", "division", "<f4"},
}

_FLOAT_FUNCTIONS = {
    *("mean", "average", "median", "std", "var", "percentile", "quantile", "linspace"),
    *("sqrt", "cbrt", "exp", "exp2", "log", "log2", "log10", "log1p", "expm1", "power", "hypot"),
    *("round", "rint", "around", "true_divide", "divide", "reciprocal", "random", "complex"),
    *("sin", "cos", "tan", "arctan2", "float_power", "double", "single", "half", "floating"),
}
_FLOAT_MODULES = {"math", "cmath", "random", "statistics", "decimal", "fractions"}
_FLOAT_DTYPE = re.compile(r"[<>=]?(f[248]|[efdg]|float\d*|double|c8|c16)")


def _get_module_name(path):
    return path.relative_to(PACKAGE).as_posix()


def _parse(path):
    return ast.parse(path.read_text("utf-8"))


def _find_constant_floats(node):
    if isinstance(node.value, float | complex):
        yield "literal"
    if isinstance(node.value, str) and _FLOAT_DTYPE.fullmatch(node.value):
        yield node.value


def _find_division_floats(node):
    # In `layouts`, "name" / Int8ul names a field in construct's notation.
    left_operand = node.left if isinstance(node, ast.BinOp) else node.target
    is_field_name = isinstance(left_operand, ast.Constant) and isinstance(left_operand.value, str)
    if isinstance(node.op, ast.Div) and not is_field_name:
        yield "division"


def _find_named_floats(name):
    if name in _FLOAT_FUNCTIONS or re.fullmatch(r"c?[Ff]loat\d*[lbn]?", name):
        yield name


def _find_imported_floats(node):
    if isinstance(node, ast.ImportFrom) and node.module in _FLOAT_MODULES:
        yield node.module
    for alias in node.names:
        if alias.name in _FLOAT_MODULES:
            yield alias.name
        yield from _find_named_floats(alias.name)


_FINDERS = {
    ast.Constant: _find_constant_floats,
    ast.BinOp: _find_division_floats,
    ast.AugAssign: _find_division_floats,
    ast.Name: lambda node: _find_named_floats(node.id),
    ast.Attribute: lambda node: _find_named_floats(node.attr),
    ast.Import: _find_imported_floats,
    ast.ImportFrom: _find_imported_floats,
}


def find_floats(tree):
    """Return the kinds of floating-point operations and literals in a syntax tree."""
    kinds_by_node = (
        _FINDERS[type(node)](node) for node in ast.walk(tree) if type(node) in _FINDERS
    )
    return {kind for kinds in kinds_by_node for kind in kinds}


@pytest.mark.parametrize("path", NORMATIVE_MODULES, ids=_get_module_name)
def test_normative_code_has_no_floats_except_those_of_the_spec(path):
    assert find_floats(_parse(path)) == ALLOWED_FLOATS.get(_get_module_name(path), set())


def test_every_file_that_may_contain_floats_exists():
    assert ALLOWED_FLOATS.keys() <= {_get_module_name(path) for path in NORMATIVE_MODULES}


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
    line_counts = {
        _get_module_name(path): len(path.read_text("utf-8").splitlines()) for path in MODULES
    }

    assert {name: size for name, size in line_counts.items() if size > 320} == {}
    large_modules = [name for name, size in line_counts.items() if size > 250]
    assert len(large_modules) <= len(line_counts) / 20


def _list_long_functions(path, max_lines):
    for node in ast.walk(_parse(path)):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            if body and body[-1].end_lineno - body[0].lineno + 1 > max_lines:
                yield f"{_get_module_name(path)}: {node.name}"


def test_functions_are_short_except_kernels():
    modules = [path for path in MODULES if path not in KERNEL_MODULES]

    assert [function for path in modules for function in _list_long_functions(path, 40)] == []


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

    assert {path for path in importers if path.name != "compiled.py"} <= set(KERNEL_MODULES)
    assert importers


@pytest.mark.parametrize("path", KERNEL_MODULES, ids=_get_module_name)
def test_kernels_import_only_numerical_modules_and_kernels(path):
    other_names = [
        name
        for name in _list_imports(_parse(path))
        if name.split(".")[0] not in {"math", "numba", "numpy"}
        and not name.endswith(("kernels", ".compiled"))
    ]

    assert other_names == []


@pytest.mark.parametrize("path", KERNEL_MODULES, ids=_get_module_name)
def test_all_functions_of_kernels_are_compiled_except_those_for_constants(path):
    tree = _parse(path)
    uncompiled_functions = {
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and not node.decorator_list
    }
    constant_values = [node.value for node in tree.body if isinstance(node, ast.Assign)]
    called_functions = {
        node.func.id
        for constant in constant_values
        for node in ast.walk(constant)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }

    assert uncompiled_functions <= called_functions
    assert not any(isinstance(node, ast.ClassDef) for node in tree.body)


def test_only_one_module_opens_files_to_read_with_ffmpeg():
    opening_call = re.compile(r"\bav\.(open|CodecContext)\b")
    openers = {
        _get_module_name(path) for path in MODULES if opening_call.search(path.read_text("utf-8"))
    }

    writers = {"datasets/sound_track.py", "datasets/video_writer.py"}
    assert openers == {"datasets/media.py", *writers}


_WRITING_METHODS = {
    "write_bytes",
    "write_text",
    "rmtree",
    "copyfile",
    "copytree",
    "mkstemp",
    "rename",
}


def _list_writes(tree):
    """Yield the method names or modes of calls that create, replace or delete files."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in _WRITING_METHODS:
            yield node.attr
        if isinstance(node, ast.Call) and getattr(node.func, "attr", None) == "open":
            modes = [
                argument.value for argument in node.args[:1] if isinstance(argument, ast.Constant)
            ]
            yield from (str(mode) for mode in modes if re.fullmatch(r"[wxa]b?\+?|r\+b", str(mode)))


def test_only_one_package_writes_files():
    other_modules = [path for path in MODULES if path.parent.name != "files"]
    writers = {_get_module_name(path) for path in other_modules if any(_list_writes(_parse(path)))}

    assert writers == set()
    assert any(_list_writes(_parse(PACKAGE / "files" / "folders.py")))
    assert list(_list_writes(ast.parse("Path('a').open('wb'); Path('b').write_bytes(b'')")))


def test_the_package_itself_imports_nothing():
    assert list(_list_imports(_parse(PACKAGE / "__init__.py"))) == []


def test_decoding_and_inspection_load_without_heavy_packages():
    module_names = [
        "quarc_ref."
        + _get_module_name(path).removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        for path in LIGHT_MODULES
        if path.name != "__main__.py" and (find_fast_engine() or not path.name.startswith("fast_"))
    ]
    blocking_lines = "".join(f"sys.modules[{name!r}] = None\n" for name in HEAVY_PACKAGES)
    program = "import sys\n" + blocking_lines + "".join(f"import {name}\n" for name in module_names)

    subprocess.run([sys.executable, "-c", program], check=True)
