"""The house: imports run one way, every room ships, public names are documented with units."""

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ROOMS = ("model", "identification", "optimize", "studies")
MAY_IMPORT = {
    "model": {"model"},
    "identification": {"model", "identification"},
    "optimize": {"model", "optimize"},
    "studies": {"model", "identification", "optimize", "studies"},
}
# Libraries that are met in one place alone.
PLACES = {
    "casadi": "optimize/solve",
    "emcee": "identification/sample.py",
    "optuna": "optimize/search",
    "distributed": "optimize/sweep_cluster.py",
    "matplotlib": "studies/",
    "jinja2": "studies/",
    "typer": "studies/",
    "rich": "studies/",
    "pint": "identification/",
}
MOST_LINES = 450
NUMBERS = {"float", "ndarray", "Array", "ArrayLike", "NDArray"}
SOURCES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
BY_NAME = pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))


def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def module_of(path: Path) -> tuple[str, ...]:
    parts = ("supple", *path.relative_to(ROOT).with_suffix("").parts)
    return parts[:-1] if parts[-1] == "__init__" else parts


def is_module(name: tuple[str, ...]) -> bool:
    place = ROOT.joinpath(*name[1:])
    return place.with_suffix(".py").is_file() or (place / "__init__.py").is_file()


def imports(path: Path) -> Iterator[tuple[tuple[str, ...], str]]:
    """Every module that a file imports, wherever in the file, and how.

    How is ``absolute``, ``relative``, or ``face`` for a name taken from the face of a room.
    """
    package = ("supple", *path.parent.relative_to(ROOT).parts)
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from ((tuple(alias.name.split(".")), "absolute") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else ()
            base = start + tuple(node.module.split(".") if node.module else ())
            is_face = len(base) > 1 and ROOT.joinpath(*base[1:], "__init__.py").is_file()
            for alias in node.names:
                whole = (*base, alias.name)
                if base[:1] == ("supple",) and is_module(whole):
                    yield whole, "relative" if node.level else "absolute"
                else:
                    yield base, "face" if is_face else "relative" if node.level else "absolute"


def in_house(path: Path) -> set[tuple[str, ...]]:
    return {name for name, _ in imports(path) if name[0] == "supple"}


@BY_NAME
def test_imports_run_one_way(path):
    room = path.relative_to(ROOT).parts[0]
    for name in in_house(path):
        assert len(name) == 1 or name[1] in MAY_IMPORT[room], f"{room} imports {'.'.join(name)}"


@BY_NAME
def test_imports_inside_are_relative_and_from_the_file_that_defines_the_name(path):
    for name, how in imports(path):
        assert name[0] not in (*ROOMS, "tests"), f"{path} imports {'.'.join(name)}"
        assert name[0] != "supple" or how == "relative", f"{path}: {how} {'.'.join(name)}"


def test_no_file_imports_itself_in_a_circle():
    arrows = {module_of(path): in_house(path) for path in SOURCES}
    done: set[tuple[str, ...]] = set()

    def visit(name: tuple[str, ...], trail: tuple[tuple[str, ...], ...]) -> None:
        assert name not in trail, " -> ".join(".".join(step) for step in (*trail, name))
        if name in done:
            return
        for other in arrows.get(name, ()):
            visit(other, (*trail, name))
        done.add(name)

    for name in arrows:
        visit(name, ())


@BY_NAME
def test_libraries_stay_in_their_place(path):
    place = path.relative_to(ROOT).as_posix()
    for name, _ in imports(path):
        allowed = PLACES.get(name[0])
        assert allowed is None or place.startswith(allowed), f"{name[0]} is met in {allowed} alone"


def test_the_bench_shares_nothing_with_the_package():
    for path in sorted((ROOT / "tests" / "lab").rglob("*.py")):
        for name, _ in imports(path):
            ours = name[0] != "supple" or name[:3] == ("supple", "tests", "lab")
            assert ours, f"{path} imports {'.'.join(name)}"


def test_the_root_imports_nothing_of_the_house_and_holds_no_other_module():
    assert [path.name for path in ROOT.glob("*.py")] == ["__init__.py"]
    assert not in_house(ROOT / "__init__.py")
    copies = [name for name in ROOMS if name in sys.modules]
    assert copies == [], f"second copies of rooms were imported: {copies}"


@BY_NAME
def test_a_file_opens_with_its_caption_and_does_not_tire(path):
    text = path.read_text(encoding="utf-8")
    first = (ast.get_docstring(tree(path)) or "").split("\n\n")[0]
    assert first.endswith(".") and "\n" not in first, f"{path}: the first line is no sentence"
    assert text.startswith('"""' + first[:20])
    assert text.count("\n") <= MOST_LINES


def public(path: Path) -> Iterator[tuple[str, ast.ClassDef | ast.FunctionDef]]:
    """Public classes, functions and methods of a file, with their dotted names."""
    for node in tree(path).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            yield node.name, node
            for inner in node.body if isinstance(node, ast.ClassDef) else []:
                if isinstance(inner, ast.FunctionDef) and not inner.name.startswith("_"):
                    yield f"{node.name}.{inner.name}", inner


def is_number(annotation: ast.expr | None) -> bool:
    """Whether an annotation names a real number or an array of them."""
    if annotation is None:
        return False
    nodes = ast.walk(annotation)
    names = {n.id for n in nodes if isinstance(n, ast.Name)}
    names |= {n.attr for n in ast.walk(annotation) if isinstance(n, ast.Attribute)}
    return bool(names & NUMBERS) and "Callable" not in names


def says_unit(text: str) -> bool:
    """Whether a text holds a unit in brackets, or says where the unit is found."""
    return bool(re.search(r"\[[^\[\]]+\]|\bunits?\b|\b[Dd]imensionless\b", text))


def entry(doc: str, name: str) -> str:
    """What a docstring says under ``name:``, up to the next name."""
    found = re.search(
        rf"^( *){re.escape(name)}(?: \([^)]*\))?: (.*(?:\n\1 +.*)*)", doc, re.MULTILINE
    )
    return found[2] if found else ""


@BY_NAME
def test_public_names_are_documented_with_units(path):
    silent = []
    for name, node in public(path):
        doc = ast.get_docstring(node)
        if not doc:
            is_override = any(ast.unparse(d) == "override" for d in node.decorator_list)
            silent += [] if is_override else [f"{name}: no docstring"]
        elif isinstance(node, ast.ClassDef):
            silent += [f"{name}.{field}: no unit" for field in fields_without_unit(node, doc)]
        else:
            taken = [*node.args.args, *node.args.kwonlyargs]
            numbers = is_number(node.returns) or any(is_number(a.annotation) for a in taken)
            silent += [f"{name}: no unit"] if numbers and not says_unit(doc) else []
    assert silent == []


def fields_without_unit(node: ast.ClassDef, doc: str) -> list[str]:
    """Public number-valued fields of a class whose entry in the docstring has no unit."""
    fields = [
        item.target.id
        for item in node.body
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and is_number(item.annotation)
    ]
    public_fields = [field for field in fields if not field.startswith("_")]
    return [field for field in public_fields if not says_unit(entry(doc, field))]


def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def folders() -> list[str]:
    """The rooms and the rooms in them, as the packages they ship as."""
    found = [face.parent for room in ROOMS for face in (ROOT / room).rglob("__init__.py")]
    return sorted(["supple", *(".".join(module_of(path / "__init__.py")) for path in found)])


def test_every_folder_ships_and_every_file_lies_in_one():
    listed = project()["tool"]["setuptools"]["packages"]
    assert sorted(listed) == folders()
    homeless = [path for path in SOURCES if not (path.parent / "__init__.py").is_file()]
    assert homeless == []


def test_versions_are_bounded_and_the_tested_ones_lie_within():
    told = project()["project"]
    tested = dict(
        line.lower().split("==")
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if not line.startswith("#")
    )
    for wanted in [*told["dependencies"], *told["optional-dependencies"]["dev"]]:
        name, bounds = re.findall(r"^([\w-]+)(?:\[\w+\])?(.*)$", wanted)[0]
        assert ">=" in bounds and "<" in bounds, wanted
        packaging = pytest.importorskip("packaging.specifiers")
        assert packaging.SpecifierSet(bounds).contains(tested[name.lower()]), wanted
    namespace: dict[str, object] = {}
    exec((ROOT / "__init__.py").read_text(encoding="utf-8"), namespace)
    assert namespace["__version__"] == told["version"]


def test_the_wheel_holds_the_rooms_and_nothing_else(tmp_path):
    tree_copy = tmp_path / "tree"
    tree_copy.mkdir()
    for name in ("pyproject.toml", "__init__.py", "py.typed", "README.md", "LICENSE", *ROOMS):
        source = ROOT / name
        if source.is_dir():
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(source, tree_copy / name, ignore=ignored)
        elif source.is_file():
            shutil.copy(source, tree_copy / name)
    build = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
    command = [sys.executable, "-W", "ignore", "-c", build, str(tmp_path)]
    subprocess.run(command, cwd=tree_copy, check=True, capture_output=True)
    wheel = zipfile.ZipFile(next(tmp_path.glob("*.whl")))
    shipped = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert {name.split("/")[0] for name in shipped} == {"supple"}
    data = (ROOT / "studies").glob("*.html")
    wanted = [ROOT / "__init__.py", ROOT / "py.typed", *SOURCES, *data]
    wanted += [path for path in (ROOT / "studies" / "data").rglob("*") if path.is_file()]
    assert shipped == {f"supple/{path.relative_to(ROOT).as_posix()}" for path in wanted}


def test_help_is_quick_because_nothing_heavy_is_imported():
    heavy = "jax pandas scipy pint pydantic matplotlib casadi optuna emcee".split()
    code = f"import sys, supple.studies.cli; print(*[m for m in {heavy} if m in sys.modules])"
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd="/"
    )
    assert told.stdout.split() == []


def test_double_precision_is_on():
    code = "import supple, jax.numpy as n; print(n.ones(1).dtype)"
    for order in (code, "import jax; " + code):
        told = subprocess.run(
            [sys.executable, "-c", order], capture_output=True, text=True, check=True, cwd="/"
        )
        assert told.stdout.strip() == "float64"


def readme_blocks() -> list[tuple[str, str]]:
    """Opening line (language and file name) and body of each block of README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return re.findall(r"^```([^\n`]+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


QUICK = ("check", "simulate")


@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_blocks_of_the_readme_run(tmp_path, whole):
    bin_folder = Path(sys.executable).parent
    environment = os.environ | {"PATH": f"{bin_folder}{os.pathsep}{os.environ['PATH']}"}
    n_run = 0
    for opening, body in readme_blocks():
        language, *name = opening.split()
        if language == "toml" and name:
            tomllib.loads(body)
            (tmp_path / name[0]).write_text(body, encoding="utf-8")
        commands = [[sys.executable, "-c", body]] if language == "python" else []
        if language == "console":
            lines = [line[2:] for line in body.splitlines() if line.startswith("$ supple ")]
            words = [shlex.split(line) for line in lines]
            commands = [w for w in words if whole or w[1] in QUICK or w[-1] == "--help"]
        for command in commands:
            told = subprocess.run(
                command, cwd=tmp_path, env=environment, capture_output=True, text=True
            )
            assert told.returncode == 0, f"{command}: {told.stdout}\n{told.stderr}"
            n_run += 1
    assert n_run >= 2


def test_the_readme_names_only_files_that_exist():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (ROOT / target).exists(), target
    numbered = re.findall(r"^\| (\d) \|", text, re.MULTILINE)
    assert all(int(b) == int(a) + 1 for a, b in pairwise(numbered)), "exit codes in order"
