"""The published package: stubs, examples, help."""

import ast
import doctest
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import hapterra
from hapterra import _native

PACKAGE = Path(hapterra.__file__).parent


def test_stubs_have_the_compiled_names_and_parameters():
    assert (PACKAGE / "py.typed").is_file()
    stub = ast.parse((PACKAGE / "_native.pyi").read_text("utf-8"))
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    compiled = {name: it for name, it in vars(_native).items() if inspect.isclass(it)}
    assert classes.keys() == compiled.keys()
    functions = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
    assert functions == {name for name, it in vars(_native).items() if inspect.isbuiltin(it)}
    for name, stated in classes.items():
        methods = {node.name: node for node in stated.body if isinstance(node, ast.FunctionDef)}
        found = {it for it in vars(compiled[name]) if not it.startswith("_")}
        assert found == {it for it in methods if not it.startswith("_")}
        # CPython 3.9 has no signatures of such classes.
        if compiled[name].__text_signature__ is None:
            assert sys.version_info < (3, 10)
            continue
        parameters = list(inspect.signature(compiled[name]).parameters)
        arguments = methods["__new__"].args
        assert [it.arg for it in arguments.args[1:] + arguments.kwonlyargs] == parameters


@pytest.mark.skipif(sys.version_info < (3, 11), reason="its numpy states fewer types")
def test_types_are_consistent():
    words = "-m mypy --strict --ignore-missing-imports --cache-dir=".split()
    words[-1] += os.devnull
    told = subprocess.run([sys.executable, *words, "-p", "hapterra"], capture_output=True, text=True)
    assert told.returncode == 0, told.stdout + told.stderr


def test_every_public_name_has_a_docstring():
    for name in set(hapterra.__all__) - {"STEP"}:
        it = getattr(hapterra, name)
        assert it.__doc__, name
        for member, value in vars(it).items() if inspect.isclass(it) else []:
            if inspect.isfunction(value) and not member.startswith("_"):
                assert value.__doc__, f"{name}.{member}"


def test_example_in_the_docstring_is_right():
    assert doctest.testmod(hapterra).failed == 0


def test_example_in_the_readme_draws_forces(tmp_path):
    readme = (Path(__file__).parent.parent / "README.md").read_text("utf-8")
    example = re.search(r"```python\n(.*?)```", readme, re.S)[1]
    example = "import matplotlib\nmatplotlib.use('Agg')\n" + example
    example += "assert steps['force_n'][:, 2].max() > 0.5\n"
    strict = [sys.executable, "-W", "error::UserWarning:__main__"]
    subprocess.run([*strict, "-c", example], cwd=tmp_path, check=True)
    assert (tmp_path / "forces.png").stat().st_size > 5000


def test_examples_of_the_tutorial_run_in_their_order(tmp_path):
    page = Path(__file__).parents[2] / "docs/tutorials/array-to-forces.md"
    examples = re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.S)
    outputs = re.findall(r"```text\n(.*?)```", page.read_text("utf-8"), re.S)
    assert (len(examples), len(outputs)) == (4, 2)
    command = [sys.executable, "-c", "\n".join(examples)]
    ran = subprocess.run(command, cwd=tmp_path, check=True, stdout=subprocess.PIPE, text=True)
    assert ran.stdout == "".join(outputs)
    assert (tmp_path / "forces.png").stat().st_size > 5000


@pytest.mark.parametrize(
    "code, free_of",
    [
        ("import hapterra", {"numpy", "pandas", "xarray", "rasterio"}),
        ("from hapterra import *", {"pandas", "xarray", "rasterio"}),
    ],
)
def test_imports_are_minimal(code, free_of):
    code = f"import sys; {code}; print({free_of!r} & set(sys.modules))"
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert told.stdout.strip() == "set()"


def test_all_names_are_exported():
    assert set(hapterra.__all__) == set(hapterra._MODULES)
    assert set(hapterra.__all__) <= set(dir(hapterra))
    with pytest.raises(AttributeError, match="module 'hapterra' has no attribute 'nothing'"):
        hapterra.nothing
