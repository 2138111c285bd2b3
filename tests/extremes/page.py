"""The table as a page of the documentation."""

INTRODUCTION = """# Extremes

Scenes with a known answer, each pushed along one axis: ratio of masses 10^±12, friction 0, 10^3 and infinite, steps a thousand
times too large and too small, bodies of 10^-9 m and of 10^6 m and both in one scene, places 10^9 m from the origin with and
without `scene.origin`, overlaps, bodies in one place, no bodies and many, input that is no number.

The reference of a cell comes from mechanics. Its gate comes from the tolerance of the solver (`tol`, 10^-10; of piles 10^-6)
or from rounding; a reference says which, and where rounding sets the gate, how much. With places 10^9 m off and no origin,
twice the spacing of doubles there, 4.8 10^-7 m, is allowed beside it. Every cell must also end with numbers that are numbers,
with a closed balance of energy (10^-12 of the energy in play; where a light body carries a heavy one, a velocity is a
difference of impulses as many times larger as the ratio of masses, and four roundings times the ratio are allowed), with a
status that agrees with its residual, and with the status `converged` unless the row says otherwise. A status counts as an
answer only where no solution exists (crushed), or where the row says so (piles at a step x 1e3, some steps of which do not
converge).

Beside each cell stands the figure that came nearest to its gate, and its error. {failures}

    script/bench extremes                    # the whole table, as CSV
    script/bench extremes --small --markdown # this page: without the cells of many bodies
"""


def failures(rows):
    """How many cells fail, in words."""
    wrong = [cell.name for cell, _, _, verdict in rows if verdict != "ok"]
    if not wrong:
        return f"All {len(rows)} cells of this page are right."
    return f"Of {len(rows)} cells {len(wrong)} fail: " + "; ".join(wrong) + "."


def words(text):
    return str(text).replace("|", "\\|").replace("\\[", "[").replace("\\]", "]")


def page(rows):
    """rows: (cell, figure, error, verdict)."""
    lines, scene = [INTRODUCTION.replace("{failures}", failures(rows))], None
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
            lines.append(f"| {words(cell.extreme)} | {words(cell.reference)} | {words(verdict)} |")
        else:
            lines.append(f"| {words(cell.extreme)} | {words(figure)} | {error:.2g} | {words(verdict)} |")
    return "\n".join(lines)
