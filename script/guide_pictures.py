"""Runs the blocks of pages that make a picture, and puts the pictures (guide_*.png) into docs/images."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)

for page in [*sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/guide").glob("*.md"))]:
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    if "guide_" not in "".join(blocks):
        continue
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "blocks.py"
        script.write_text("\n".join(blocks), encoding="utf-8")
        subprocess.run([sys.executable, script], cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"}, check=True)
        for picture in Path(folder).glob("guide_*.png"):
            shutil.copy(picture, ROOT / "docs/images" / picture.name)
            print(picture.name)
