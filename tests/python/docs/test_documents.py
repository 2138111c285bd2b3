"""The Python blocks of README and docs run as they stand, page by page, each in a fresh folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)


# libraries without which the blocks of a page are skipped
LIBRARIES = {"compas.md": ("compas_dem", "compas_lmgc90")}


def pages():
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in found if BLOCK.search(page.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_blocks_run(page, tmp_path):
    for library in LIBRARIES.get(page.name, ()):
        pytest.importorskip(library, reason=f"{page.name} needs {library}")
    script = tmp_path / "blocks.py"
    script.write_text("\n".join(BLOCK.findall(page.read_text(encoding="utf-8"))), encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert ended.returncode == 0, ended.stderr


def test_local_links_lead_somewhere():
    missing = []
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")]:
        for target in re.findall(r"\]\((?!https?:|#|mailto:)([^)#\s]+)", page.read_text(encoding="utf-8")):
            if not (page.parent / target).exists():
                missing.append(f"{page.relative_to(ROOT)}: {target}")
    assert not missing


def test_pages_of_the_guide_show_a_picture_and_are_listed():
    index = (ROOT / "docs/guide/index.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs/guide").glob("*.md"):
        if page.name != "index.md":
            assert "](../images/guide_" in page.read_text(encoding="utf-8"), page
            assert f"\n{page.stem}\n" in index, page


def test_the_gallery_has_a_page_and_a_thumbnail_of_each_example(tmp_path, monkeypatch):
    Image = pytest.importorskip("PIL.Image")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import gallery

    names = gallery.write(tmp_path)
    assert set(names) == {path.name for path in (ROOT / "examples").iterdir() if (path / f"{path.name}.py").exists()}
    assert set(gallery.PARTS) <= set(names)
    index = (tmp_path / "index.md").read_text(encoding="utf-8")
    for name in names:
        page = (tmp_path / f"{name}.md").read_text(encoding="utf-8")
        assert f"](../images/example_{name}.png)" in page and "## The program" in page and f'href="{name}.html"' in index
        with Image.open(tmp_path / f"{name}.jpg") as small:
            assert small.size == (640, 480)


def test_readme_scene_is_short():
    block = BLOCK.search((ROOT / "README.md").read_text(encoding="utf-8"))[1]
    statements = [line for line in block.splitlines() if line and not line.startswith(("import", " "))]
    assert len(statements) <= 10
