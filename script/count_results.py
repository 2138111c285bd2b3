"""Sums the results that script/test left: JUnit files of GoogleTest and pytest, and one line per command."""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def junit(path):
    passed = failed = skipped = 0
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            failed += 1
            print(f"failed: {path.stem}: {case.get('classname')}.{case.get('name')}")
        elif case.find("skipped") is not None or case.get("status") == "notrun":
            skipped += 1
        else:
            passed += 1
    return passed, failed, skipped


def commands(path):
    lines = path.read_text().splitlines() if path.exists() else []
    for line in lines:
        if not line.startswith("passed"):
            print(line)
    kinds = [line.split()[0] for line in lines]
    return kinds.count("passed"), kinds.count("failed"), kinds.count("skipped")


def main(folder):
    counts = [junit(path) for path in sorted(folder.glob("*.xml"))] + [commands(folder / "commands")]
    passed, failed, skipped = (sum(column) for column in zip(*counts))
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
