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
    """Text of an example for its page: lines of a paragraph are joined, indented blocks keep theirs."""
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


# Part of the picture that a thumbnail shows, as shares of width and height (left, top, right, bottom): whole panels. Others: all.
PARTS = {
    "arch_on_spreading_supports": (0.0, 0.0, 0.48, 1.0),
    "bent_plate": (0.43, 0.05, 0.83, 1.0),
    "biaxial": (0.0, 0.0, 0.575, 1.0),
    "bonded_disks": (0.0, 0.0, 0.52, 0.86),
    "clump_collapse": (0.5, 0.0, 1.0, 1.0),
    "disc_brake": (0.0, 0.15, 0.44, 0.85),
    "drum": (0.0, 0.0, 1.0, 0.47),
    "fault_propagation": (0.0, 0.0, 0.455, 1.0),
    "flue_wall": (0.0, 0.0, 0.3, 1.0),
    "forced_fold": (0.0, 0.52, 0.455, 1.0),
    "grains_between_plates": (0.0, 0.0, 0.55, 1.0),
    "hopper": (0.0, 0.0, 0.46, 1.0),
    "ironing": (0.0, 0.0, 0.44, 0.48),
    "leaning_wall": (0.5, 0.0, 1.0, 1.0),
    "pont_du_gard": (0.25, 0.16, 0.68, 0.9),
    "powder_under_current": (0.44, 0.52, 0.89, 1.0),
    "rubber_ring": (0.0, 0.1, 0.455, 0.95),
    "shear_cell": (0.5, 0.0, 0.97, 0.5),
    "spheres_in_a_box": (0.0, 0.0, 0.44, 1.0),
    "wheel_and_rail": (0.0, 0.0, 1.0, 0.62),
}


def thumbnail(source, target):
    """A picture of the width of a thumbnail, twice as fine: the panels that PARTS names, on a white ground of 4 by 3."""
    from PIL import Image

    with Image.open(source) as whole:
        colours = whole.convert("RGBA")
    image = Image.alpha_composite(Image.new("RGBA", colours.size, "white"), colours).convert("RGB")
    left, top, right, bottom = PARTS.get(source.stem.removeprefix("example_"), (0.0, 0.0, 1.0, 1.0))
    image = image.crop((int(left * image.width), int(top * image.height), int(right * image.width), int(bottom * image.height)))
    size = 2 * WIDTH, 2 * WIDTH * 3 // 4
    scale = min(size[0] / image.width, size[1] / image.height)
    image = image.resize((max(int(image.width * scale), 1), max(int(image.height * scale), 1)), Image.LANCZOS)
    ground = Image.new("RGB", size, "white")
    ground.paste(image, ((size[0] - image.width) // 2, (size[1] - image.height) // 2))
    ground.save(target, quality=85)


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
