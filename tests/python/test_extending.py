"""The walks of docs/extending.md, followed: their files and rows go into a copy of the sources, which is built and run."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "extending.md"
STEP = re.compile(r"^<!-- (file|row|then):? ?([^|\n]*?)(?: \| after: (.*?))? -->\n```\w+\n(.*?)^```", re.M | re.S)
SOURCES = ("CMakeLists.txt", "CMakePresets.json", "bindings", "cmake", "core_f90", "cxx", "fortran", "LICENSE", "python")


def walks():
    """(kind, path, the line after which it stands, text), in the order of the page."""
    return STEP.findall(PAGE.read_text(encoding="utf-8"))


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


def test_the_page_counts_the_files_of_each_walk():
    """Those that are new or get a row."""
    page = PAGE.read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", page, re.M | re.S))
    counted = 0
    for title, said in re.findall(r"^\| \[(.*?)\]\(.*?\) \|.*?\| (\d+).*?\|$", page, re.M):
        heading = title[0].upper() + title[1:]
        section = next((text for name, text in sections.items() if name == heading), "")
        touched = {path for kind, path, _, _ in STEP.findall(section) if kind != "then"}
        if touched:
            counted += 1
            assert len(touched) == int(said), f"{title}: {sorted(touched)}"
    assert counted >= 7


@pytest.mark.timeout(1800)
def test_the_walks_build_and_do_what_the_page_says(tmp_path):
    """One build of the module alone, without optimisation. A row reaches core.h, so that all that reads it is compiled anew:
    three CPU minutes, and the test is run when CAIRN_LARGE is set. OneDisk.SinksWhereItsLawHasACompliance stands for the law."""
    if not os.environ.get("CAIRN_LARGE"):
        pytest.skip("a build of all sources, three CPU minutes: set CAIRN_LARGE=1")
    if not (shutil.which("cmake") and shutil.which("ninja") and shutil.which("gfortran")):
        pytest.skip("cmake, ninja and gfortran build what the walks add")
    tree, build = tmp_path / "tree", tmp_path / "build"
    tree.mkdir()
    follow(tree)
    launcher = [f"-DCMAKE_{c}_COMPILER_LAUNCHER=ccache" for c in ("C", "CXX")] if shutil.which("ccache") else []
    quick = [f"-DCMAKE_{language}_FLAGS_WALK=-O0" for language in ("C", "CXX", "Fortran")]  # of a kind of build of its own
    options = [
        "-DCMAKE_BUILD_TYPE=Walk",
        "-DCAIRN_TESTS=OFF",
        "-DCAIRN_BENCHMARKS=OFF",
        "-DCAIRN_WERROR=OFF",
        f"-DPython_EXECUTABLE={sys.executable}",
        *quick,
        *launcher,
    ]
    environment = {**os.environ, "CCACHE_BASEDIR": str(tree), "CCACHE_NOHASHDIR": "1"}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment.get('PATH', '')}"
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
