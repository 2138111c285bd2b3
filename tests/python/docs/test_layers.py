"""Folders of the object layer compile with the headers of the folders below them alone."""

import json
import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
LAYERS = re.search(r"set\(CAIRN_LAYERS\n([^)]*)\)", (ROOT / "cxx/sources.cmake").read_text(encoding="utf-8"))[1].split()
HEADERS = {layer: sorted((ROOT / "cxx" / layer).rglob("*.hpp")) for layer in LAYERS}


@pytest.fixture(scope="module")
def commands():
    """{folder: (directory, command that compiles one of its sources)} of the build that CAIRN_BUILD names."""
    built = Path(os.environ["CAIRN_BUILD"]) if "CAIRN_BUILD" in os.environ else None
    if not (built and (built / "compile_commands.json").exists()):
        pytest.skip("CAIRN_BUILD names no build with compile_commands.json")
    out = {}
    for entry in json.loads((built / "compile_commands.json").read_text(encoding="utf-8")):
        found = re.search(r"cxx/CMakeFiles/cairn_(\w+)\.dir/", entry.get("output", entry["command"]))
        if found and found[1] in LAYERS:
            out.setdefault(found[1], (Path(entry["directory"]), shlex.split(entry["command"])))
    return out


def preprocess(command, text):
    """Exit code and messages of a source that stands in the folder, with the paths and definitions that the folder compiles with.

    The preprocessor alone is asked: it does not read precompiled headers, which are left out with all other options.
    """
    directory, words = command
    tree = next(p for p in (directory / "cxx" / "layers").iterdir() if f"cairn_{p.name}.dir" in " ".join(words))
    compiler = next(word for word in words if not word.endswith("ccache"))
    kept = [word for word in words if word.startswith(("-I", "-D", "-std"))]
    kept += [part for k, word in enumerate(words) if word in ("-isystem", "-iquote") for part in words[k : k + 2]]
    inside = tree / "cxx" / tree.name
    asked = [compiler, *kept, f"-iquote{inside}", "-E", "-x", "c++", "-", "-o", os.devnull]
    ended = subprocess.run(asked, cwd=directory, input=text, capture_output=True, text=True)
    return ended.returncode, ended.stderr


def test_each_folder_is_a_target(commands):
    """Each folder of cxx is a layer, and each layer an object library of its own."""
    assert sorted(LAYERS) == sorted(p.name for p in (ROOT / "cxx").iterdir() if p.is_dir() and p.name != "include")
    assert sorted(commands) == sorted(LAYERS)


def test_a_folder_finds_the_headers_below_it_alone(commands):
    """Headers below are found, those above are not, by any of the paths that a file would write."""
    for k, layer in enumerate(LAYERS):
        names = {other: HEADERS[other][0].relative_to(ROOT / "cxx") for other in LAYERS if HEADERS[other]}
        asked = [(True, f"../{names[other]}") for other in LAYERS[: k + 1] if other in names]
        asked += [
            (False, f"{dots}{names[other]}")
            for other in LAYERS[k + 1 :]
            if other in names
            for dots in ("../", "", "cxx/", "../../")
        ]
        text = "".join(f'#if {"!" * there}__has_include("{name}")\n#error "{name}"\n#endif\n' for there, name in asked)
        code, said = preprocess(commands[layer], text)
        assert code == 0, f"{layer}: {said}"


def test_an_upward_include_is_refused(commands):
    """The compiler stops at it, and goes past one that points downward."""
    upward, downward = (HEADERS[layer][0].relative_to(ROOT / "cxx") for layer in ("solvers", "base"))
    code, said = preprocess(commands["meshes"], f'#include "../{upward}"\n')
    assert code != 0
    assert "No such file" in said or "not found" in said, said
    assert preprocess(commands["meshes"], f'#include "../{downward}"\n')[0] == 0


def test_no_two_classes_share_a_name():
    """The linker joins classes of one name without a word, and objects of one are destroyed as objects of the other."""
    found = {}
    for path in sorted((ROOT / "cxx").rglob("*.hpp")):
        for name in re.findall(r"^(?:class|struct) (\w+)(?: final)?(?: : [^;{]*)? \{", path.read_text(encoding="utf-8"), re.M):
            found.setdefault(name, []).append(path.name)
    assert len(found) > 300
    assert not {name: files for name, files in found.items() if len(files) > 1}
