"""The parts of NLGS in steps: their list, and the page that tells them."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def listed():
    """[(name, meaning)] of parts.def."""
    text = (ROOT / "cxx/solvers/nlgs/parts.def").read_text(encoding="utf-8")
    return re.findall(r'^CAIRN_NLGS_PART\((\w+), +"(.*?)"\)', text, re.M)


def test_the_page_tells_every_part_in_the_order_of_the_list():
    page = (ROOT / "docs/problems.md").read_text(encoding="utf-8")
    table = page.partition("| part | what it does | takes part where |\n")[2].partition("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \| (.*?) \|", table, re.M) == listed()


def test_the_loop_is_as_short_as_a_page_and_knows_no_part():
    """Mechanisms stay out of the loop: it names none of them."""
    source = (ROOT / "cxx/solvers/nlgs/nlgs.cpp").read_text(encoding="utf-8")
    loop = source[source.index("  void run() {") : source.index("  void finish() {")]
    assert loop.count("\n") <= 40
    assert not [name for name, _ in listed() if name in loop]
