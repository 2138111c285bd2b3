"""The walks of docs/extending.md, followed: their files and rows go into a copy of the sources, which is built and run."""

import functools
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "extending.md"
STEP = re.compile(r"^<!-- (file|row|then):? ?([^|\n]*?)(?: \| after: (.*?))? -->\n```\w+\n(.*?)^```", re.M | re.S)
SOURCES = ("CMakeLists.txt", "CMakePresets.json", "bindings", "cmake", "core_f90", "cxx", "fortran", "LICENSE", "python")


INCLUDE = re.compile(r'^#\s*include\s+[<"]([^>"]+)[>"]', re.M)
INCLUDED = ("cxx", "cxx/include", "core_f90/include", "core_f90")  # folders that the compiler is given

BUILT = Path(os.environ["CAIRN_BUILD"]) if "CAIRN_BUILD" in os.environ else None
# Launcher in place of a compiler: objects compiled before and unchanged by a walk are reused.
LAUNCHER = """#!/bin/sh
before=$1
shift
for word; do
  case $last in -o) object=$word ;; -MF) told=$word ;; esac
  last=$word
done
[ -f "$before/$object" ] || exec "$@"
cp "$before/$object" "$object"
[ -z "$told" ] || echo "$object:" >"$told"
"""


def walks():
    """(kind, path, the line after which it stands, text), in the order of the page."""
    return STEP.findall(PAGE.read_text(encoding="utf-8"))


def sections():
    """{heading: text} of the page."""
    return dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE.read_text(encoding="utf-8"), re.M | re.S))


def follow(tree):
    """Files and rows of all walks into a copy of the sources."""
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", "*.so"))
        else:
            shutil.copy2(ROOT / name, tree / name)
    for kind, path, after, text in walks():
        if kind == "file":
            assert not (tree / path).exists(), f"{path} is there already"
            (tree / path).write_text(text, encoding="utf-8")
        elif kind == "row":
            lines = (tree / path).read_text(encoding="utf-8").splitlines(keepends=True)
            found = [k for k, line in enumerate(lines) if after in line]
            assert found, f"{path} has no line with {after!r}"
            lines.insert(found[-1] + 1, text)
            (tree / path).write_text("".join(lines), encoding="utf-8")


@functools.cache
def compiled_before():
    """{object of the library and the module: the sources of this tree that it was made of}, of the build that CAIRN_BUILD names;
    objects older than a source are left out."""
    if not (BUILT and shutil.which("ninja") and (BUILT / "build.ninja").exists()):
        pytest.skip("CAIRN_BUILD names no build by ninja")
    told = subprocess.run(["ninja", "-t", "deps"], cwd=BUILT, capture_output=True, text=True, check=True).stdout
    made = {}
    for block in told.split("\n\n"):
        head, *lines = block.strip().split("\n")
        name = head.partition(":")[0]
        sources = [BUILT / word for line in lines if not (word := line.strip()).startswith(("/usr/", sys.prefix))]
        if not name.startswith(("cxx/", "bindings/", "core_f90/")) or not (BUILT / name).exists():
            continue
        own = [p for p in map(Path.resolve, sources) if p.is_relative_to(ROOT) and not p.is_relative_to(BUILT.resolve())]
        if all(p.exists() and p.stat().st_mtime <= (BUILT / name).stat().st_mtime for p in own):
            made[name] = {str(p.relative_to(ROOT)) for p in own}
    for made_of in BUILT.glob("core_f90/CMakeFiles/cairn_core.dir/**/*.f90.o"):
        source = ROOT / "core_f90" / str(made_of.relative_to(BUILT / "core_f90/CMakeFiles/cairn_core.dir"))[:-2]
        if source.exists() and source.stat().st_mtime <= made_of.stat().st_mtime:
            made[str(made_of.relative_to(BUILT))] = {str(source.relative_to(ROOT))}
    return made


@functools.cache
def includes(path):
    """Files of the project that a source includes, itself or through others."""
    seen, open_ones = set(), [path]
    while open_ones:
        one = open_ones.pop()
        if one in seen:
            continue
        seen.add(one)
        for name in INCLUDE.findall(one.read_text(encoding="utf-8")):
            places = [one.parent / name, *(ROOT / folder / name for folder in INCLUDED)]
            open_ones += [place.resolve() for place in places if place.is_file()][:1]
    return frozenset(str(file.relative_to(ROOT)) for file in seen)


def seen_by(changed):
    """Sources of C++ that are compiled anew when these files change."""
    sources = [path for folder in ("cxx", "bindings") for path in (ROOT / folder).rglob("*.cpp")]
    return [str(path.relative_to(ROOT)) for path in sources if includes(path) & changed]


def unity():
    """Unity build of the folder that CAIRN_BUILD names: ON or OFF."""
    cache = BUILT / "CMakeCache.txt" if BUILT else None
    found = re.search(r"^CAIRN_UNITY:BOOL=(\w+)", cache.read_text(encoding="utf-8"), re.M) if cache and cache.exists() else None
    return found[1] if found else "OFF"


def test_the_page_counts_the_files_of_each_walk():
    """Numbers of files that are new or get a row."""
    counted = 0
    for title, said in re.findall(r"^\| \[(.*?)\]\(.*?\) \|.*?\| (\d+)[^|]*\|[^|]*\|$", PAGE.read_text(encoding="utf-8"), re.M):
        section = sections().get(title[0].upper() + title[1:], "")
        touched = {path for kind, path, _, _ in STEP.findall(section) if kind != "then"}
        if touched:
            counted += 1
            assert len(touched) == int(said), f"{title}: {sorted(touched)}"
    assert counted >= 10


def test_a_row_compiles_few_sources():
    """A row compiles at most as many sources as the page says; a list read by a common header would compile all."""
    table = re.findall(r"^\| \[(.*?)\]\(.*?\).*? \| `(.*?)`.*\| (\d+) \|$", PAGE.read_text(encoding="utf-8"), re.M)
    assert len(table) >= 12
    for title, path, most in table:
        section = sections().get(title[0].upper() + title[1:], "")
        anew = seen_by({path, *(path for kind, path, _, _ in STEP.findall(section) if kind == "row")})
        assert 0 < len(anew) <= int(most), f"{title}: {len(anew)} of {sorted(anew)}"


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("whole", [False, True], ids=["what rows reach", "all"])
def test_the_walks_build_and_do_what_the_page_says(tmp_path, whole):
    """One build of the module alone, without optimisation, that takes from the build that CAIRN_BUILD names what no walk
    changes: a CPU minute; among the large tests once more with nothing taken: four."""
    if not (shutil.which("cmake") and shutil.which("ninja") and shutil.which("gfortran")):
        pytest.skip("cmake, ninja and gfortran build what the walks add")
    tree, build, before = tmp_path / "tree", tmp_path / "build", tmp_path / "before"
    tree.mkdir()
    follow(tree)
    if not whole:
        changed = {path for kind, path, _, _ in walks() if kind == "row"}
        grown = {str(Path(path).parent) for kind, path, _, _ in walks() if kind == "file"}
        for name, sources in compiled_before().items():
            joined = "/Unity/" in name and any(path.endswith(".cpp") and str(Path(path).parent) in grown for path in sources)
            if not sources & changed and not joined:
                (before / name).parent.mkdir(parents=True, exist_ok=True)
                (before / name).symlink_to((BUILT / name).resolve())
        shutil.copytree(BUILT / "modules", build / "modules")
    launcher = tmp_path / "compile"
    launcher.write_text(LAUNCHER, encoding="utf-8")
    launcher.chmod(0o755)
    options = [
        "-DCMAKE_BUILD_TYPE=Walk",  # a kind of build of its own
        "-DCAIRN_TESTS=OFF",
        "-DCAIRN_BENCHMARKS=OFF",
        "-DCAIRN_WERROR=OFF",
        f"-DCAIRN_UNITY={unity()}",
        f"-DPython_EXECUTABLE={sys.executable}",
        *(f"-DCMAKE_{language}_FLAGS_WALK=-O0" for language in ("C", "CXX", "Fortran")),
        *(f"-DCMAKE_{language}_COMPILER_LAUNCHER={launcher};{before}" for language in ("C", "CXX", "Fortran")),
    ]
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"}
    jobs = str(os.cpu_count() or 1)
    for command in (["cmake", "--preset", "release", "-B", str(build), *options],
                    ["cmake", "--build", str(build), "--target", "_core", "-j", jobs]):  # fmt: skip
        ended = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True)
        assert ended.returncode == 0, (ended.stdout + ended.stderr)[-4000:]
    head = "import warnings\n\nimport cairn as cn\nimport numpy as np\nimport pytest\nfrom cairn import _core\n\n"
    script = tmp_path / "then.py"
    script.write_text(head + "\n".join(text for kind, _, _, text in walks() if kind == "then"), encoding="utf-8")
    environment["PYTHONPATH"] = str(build / "python")
    command = [sys.executable, str(script)]
    ended = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr[-4000:]
