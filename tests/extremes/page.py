"""The table as a page of the documentation."""

INTRODUCTION = """# Extremes

Scenes with a known answer, each pushed along one axis: ratio of masses 10^±12, friction 0, 10^3 and infinite, steps a thousand
times too large and too small, bodies of 10^-9 m and of 10^6 m and both in one scene, places 10^9 m from the origin with and
without `scene.origin`, overlaps, bodies in one place, no bodies and many, input that is no number. What must come out, and what
says so, is fixed in `tests/extremes/table.py` before anything runs; a status counts as an answer only where no solution exists or
doubles do not hold one, and the row says which. Every cell must also end with numbers that are numbers, with a closed balance of
energy (10^-12 of the energy in play; where a light body carries a heavy one, the rounding times the ratio of masses) and with the
status `converged` unless it says otherwise. Beside each cell stands the figure that came nearest to its gate, and its error.

    script/bench extremes              # the whole table, as CSV
    script/bench extremes --markdown   # this page
"""


def words(text):
    return str(text).replace("|", "\\|").replace("\\[", "[").replace("\\]", "]")


def page(rows):
    """rows: (cell, figure, error, verdict)."""
    lines, scene = [INTRODUCTION], None
    for cell, figure, error, verdict in rows:
        if cell.scene != scene:
            scene = cell.scene
            lines += ["", f"## {scene[0].upper()}{scene[1:]}", ""]
            if scene != "input":
                lines += [f"Expected: {cell.expected}. Reference: {cell.reference}.", ""]
                lines += ["| extreme | nearest to its gate | error | verdict |", "|---|---|---|---|"]
            else:
                lines += [f"Expected: {cell.expected}, holding the words of the pattern.", ""]
                lines += ["| input | words of the error | verdict |", "|---|---|---|"]
        if scene == "input":
            lines.append(f"| {words(cell.extreme)} | {words(cell.reference)} | {verdict} |")
        else:
            lines.append(f"| {words(cell.extreme)} | {words(figure)} | {error:.2g} | {verdict} |")
    return "\n".join(lines)
