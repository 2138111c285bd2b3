"""The page of the Fortran module has every public procedure with its arguments, as the sources have them."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def test_every_public_procedure_stands_on_the_page_with_all_its_arguments():
    sys.path.insert(0, str(ROOT / "docs"))
    import tables

    page = tables.fortran()
    missing, bare = [], []
    for path in sorted((ROOT / "fortran").glob("cairn_*.f90")):
        if path.stem in ("cairn_calls", "cairn_signatures"):  # what the others share
            continue
        text = path.read_text(encoding="utf-8")
        public = set(re.findall(r"\w+", " ".join(re.findall(r"^ *public *:: *(.*)$", text, re.M))))
        body = text.partition("\ncontains\n")[2]
        for kind, name, arguments in re.findall(
            r"^ *(?!end)(?:[\w()*]+ )*(subroutine|function) (\w+) *\(((?:[^()]|\n)*)\)", body, re.M
        ):
            if name not in public:
                continue
            found = re.search(rf"{kind} {name} *\(((?:[^()]|\n)*)\)(.*?)(?:\n\n|```)", page, re.S)
            if found is None:
                missing.append(name)
                continue
            for argument in re.findall(r"\w+", arguments):
                if not re.search(rf"intent\(\w+\).*::.*\b{argument}\b|::(?:.*&\n)*.*\b{argument}\b", found.group(2)):
                    bare.append(f"{name}({argument})")
    assert page.count("```fortran") > 4 and not missing and not bare, (missing, bare)
