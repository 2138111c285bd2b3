"""The gallery: a thumbnail and a page of each example, written before Sphinx reads the others, from the example's own text, its
picture and the figures that examples.md tells."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WIDTH = 320  # of a thumbnail, in pixels


def told(name, text):
    """Title and paragraphs that examples.md has on an example, without its pictures."""
    for section in re.split(r"^## ", text, flags=re.M)[1:]:
        if f"`examples/{name}`" in section:
            title, _, body = section.partition("\n")
            body = re.sub(r"^!\[.*$", "", body, flags=re.M).strip()
            return title.strip(), re.sub(r"\]\((?!https?:|#)", "](../", body)  # seen from the folder of the gallery
    raise ValueError(f"docs/examples.md does not tell of `examples/{name}`: give it a section there")


def prose(story):
    """The text of an example as a page has it: paragraphs run on, what is set in stays as it is."""
    parts = []
    for part in re.split(r"\n\s*\n", story):
        set_in = part.startswith("    ") or re.search(r"^\w[\w ]*:  ", part)
        parts.append(f"```text\n{part}\n```" if set_in else " ".join(part.split()))
    return "\n\n".join(parts)


def page(name, title, body, source):
    """One example as a MyST page."""
    tree = ast.parse(source)
    story, first = prose(ast.get_docstring(tree)).replace("$", "\\$"), tree.body[0].end_lineno + 2
    picture = f"![{title}](../images/example_{name}.png)"
    call = f"```sh\npython examples/{name}/{name}.py --output {name}\n```"
    program = f"```{{literalinclude}} ../../examples/{name}/{name}.py\n:language: python\n:lines: {first}-\n```"
    return f"# {title}\n\n{body}\n\n{picture}\n\n{story}\n\n{call}\n\n## The program\n\n{program}\n"


def thumbnail(source, target):
    """A picture of the width of a thumbnail, twice as fine: the part of 4 by 3 that has the most colours in it."""
    import numpy as np
    from PIL import Image

    with Image.open(source) as whole:
        colours = whole.convert("RGBA")
    image = Image.alpha_composite(Image.new("RGBA", colours.size, "white"), colours).convert("RGB")
    height = min(image.height, image.width * 3 // 4)
    width = min(image.width, height * 4 // 3)
    array = np.asarray(image, int)
    colourful = np.ptp(array, axis=2) + (array.min(axis=2) < 200)
    along = 1 if image.width > width else 0
    part, whole = (width, image.width) if along else (height, image.height)
    total = np.concatenate([[0], np.cumsum(colourful.sum(axis=1 - along))])
    held = total[part:] - total[:-part]
    best = np.flatnonzero(held >= 0.98 * held.max())
    first = int(best[len(best) // 2])
    box = (first, 0, first + width, height) if along else (0, first, width, first + height)
    image.crop(box).resize((2 * WIDTH, 2 * WIDTH * 3 // 4)).save(target, quality=80)


def put(target, text):
    """Writes a page if it changed, so that Sphinx does not build it anew."""
    if not target.exists() or target.read_text(encoding="utf-8") != text:
        target.write_text(text, encoding="utf-8")


def write(folder):
    """Writes index.md, a page and a thumbnail of each example into folder. Returns the names of the examples."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = (ROOT / "docs/examples.md").read_text(encoding="utf-8")
    names = sorted(path.parent.name for path in (ROOT / "examples").glob("*/*.py") if path.stem == path.parent.name)
    order = sorted(names, key=lambda name: text.index(f"`examples/{name}`"))
    cards = []
    for name in order:
        title, body = told(name, text)
        source = (ROOT / "examples" / name / f"{name}.py").read_text(encoding="utf-8")
        put(folder / f"{name}.md", page(name, title, body, source))
        picture, small = ROOT / "docs/images" / f"example_{name}.png", folder / f"{name}.jpg"
        if not small.exists() or small.stat().st_mtime < picture.stat().st_mtime:
            thumbnail(picture, small)
        image = f'<img src="../_static/gallery/{name}.jpg" alt="">'
        cards.append(f'<a class="card" href="{name}.html">{image}<span>{title}</span></a>')
    tree = "\n".join(order)
    grid = "\n".join(cards)
    put(folder / "index.md", f"""# Gallery

Each is one program that explains its physics and prints its figures; click for its page.

<style>
.gallery {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(200px, 1fr)); gap: 1rem; }}
.card {{ display: block; border: 1px solid var(--color-background-border, #ddd); border-radius: 6px; }}
.card {{ overflow: hidden; text-decoration: none; }}
.card img {{ width: 100%; display: block; }}
.card span {{ display: block; padding: 0.5rem; }}
</style>
<div class="gallery">
{grid}
</div>

```{{toctree}}
:hidden:

{tree}
```
""")  # fmt: skip
    return order
