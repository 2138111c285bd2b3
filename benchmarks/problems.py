"""Every frictional contact problem by every solver, at 1e-4 and 1e-8, beside Siconos where its answers are given.

python benchmarks/problems.py [--peers FOLDER] [--cap SECONDS] [--solvers auto --output CSV].
Problems are those of $CAIRN_REFERENCE_DATA/problems.
--write FOLDER writes them as text for problems_siconos.py, whose answers --peers reads. One core, the solve call alone, least
of some repeats; an answer counts only if it meets both errors, the true one and |natural map, rho = 1| / max(|q|, |r|, |u|):
a run that meets one alone is asked again for a tenth and a hundredth. Writes benchmarks/results/problems.csv,
docs/problems_table.md and the profiles.
"""

import argparse
import csv
import os
from pathlib import Path

import numpy as np
from cairn import problems

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", HERE.parent.parent / "shared")) / "problems"
TOLERANCES = (1e-4, 1e-8)


def ours(problem, solver, tol, cap):
    """(seconds or None, error, status, solver that gave it) of the loosest tolerance that meets both errors."""
    for asked in (tol, tol / 10, tol / 100):
        result = problem.solve(solver, asked, max_iter=10**8, max_seconds=cap)
        if not result.converged:
            return None, result.error, result.status, result.solver
        if problem.plain_error(result.r) > tol:
            continue
        seconds = result.cpu_seconds
        for _ in range(20 if seconds < 1e-3 else 4 if seconds < 0.02 else 1):
            seconds = min(seconds, problem.solve(solver, asked, max_iter=10**8).cpu_seconds)
        return seconds, result.error, result.status, result.solver
    return None, result.error, "rho = 1 not met", result.solver


def peer(problem, stem, solver, tol):
    """The same of a peer's answers, the fastest that meets both."""
    least = error = None
    exponent = round(-np.log10(tol))
    for path in stem.parent.glob(f"{stem.name}.{solver}.*.npy"):
        if int(path.suffixes[-2][1:]) < exponent:
            continue
        answer = np.load(path)
        if not np.isfinite(answer[3:]).all():
            continue
        r = answer[3:].reshape(-1, problem.dim)
        error = problem.error(r)
        if max(error, problem.plain_error(r)) <= tol and (least is None or answer[0] < least):
            least = float(answer[0])
    return least, error, "converged" if least else "failed", solver


def measure(peers, cap, solvers=None):
    rows = []
    for path in sorted(DATA.glob("*.hdf5")):
        if solvers and peers and not list(Path(peers).glob(f"{path.stem}.*.npy")):
            continue
        problem = problems.read(path)
        for tol in TOLERANCES:
            for solver in solvers or problems.solvers():
                if solver == "enumeration" and problem.contacts > 8 or solver == "lemke" and problem.contacts > 100:
                    continue
                allowed = 10 * cap if solver == "auto" else cap
                rows.append((path.stem, problem, tol, "cairn", solver, ours(problem, solver, tol, allowed)))
            if peers:
                names = {p.name[len(path.stem) + 1 :].split(".")[0] for p in Path(peers).glob(f"{path.stem}.*.npy")}
                for solver in sorted(names):
                    rows.append((path.stem, problem, tol, "siconos", solver, peer(problem, Path(peers) / path.stem, solver, tol)))
        print(path.stem, flush=True)
    return [
        {
            "problem": name,
            "dim": p.dim,
            "contacts": p.contacts,
            "tol": tol,
            "code": code,
            "solver": solver,
            "seconds": seconds,
            "error": error,
            "status": status,
            "answered_by": by,
        }
        for name, p, tol, code, solver, (seconds, error, status, by) in rows
    ]


def table(rows):
    """Markdown: auto beside the best peer, then how many each solver solved."""
    lines = ["| problem | contacts | tol | auto [ms] | by | best peer [ms] | by | peer / auto |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    ratios = {tol: [] for tol in TOLERANCES}
    for name in dict.fromkeys(r["problem"] for r in rows):
        for tol in TOLERANCES:
            mine = [r for r in rows if r["problem"] == name and r["tol"] == tol]
            auto = next(r for r in mine if r["solver"] == "auto")
            peers = [r for r in mine if r["code"] == "siconos" and r["seconds"]]
            best = min(peers, key=lambda r: r["seconds"]) if peers else None
            ratio = best["seconds"] / auto["seconds"] if best and auto["seconds"] else None
            if ratio and best["seconds"] > 1e-3:
                ratios[tol].append(ratio)
            cells = (
                name,
                auto["contacts"],
                f"{tol:g}",
                f"{1e3 * auto['seconds']:.3g}" if auto["seconds"] else auto["status"],
                auto["answered_by"],
                f"{1e3 * best['seconds']:.3g}" if best else "none",
                best["solver"] if best else "",
                f"{ratio:.2g}" if ratio else "",
            )
            lines.append("| " + " | ".join(map(str, cells)) + " |")
    for tol, values in ratios.items():
        if values:
            mean = np.exp(np.mean(np.log(values)))
            lines.append(f"\nGeometric mean of peer / auto at {tol:g}, {len(values)} problems above 1 ms: {mean:.2f}.")
    lines += ["", "| solver | solved at 1e-4 | ms, all of them | solved at 1e-8 | ms |", "|---|---|---|---|---|"]
    for code, solver in dict.fromkeys((r["code"], r["solver"]) for r in rows):
        cells = [f"{solver}" if code == "cairn" else f"Siconos {solver}"]
        for tol in TOLERANCES:
            mine = [r for r in rows if (r["code"], r["solver"], r["tol"]) == (code, solver, tol)]
            done = [r["seconds"] for r in mine if r["seconds"]]
            cells += [f"{len(done)} of {len(mine)}", f"{1e3 * sum(done):.3g}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


SHOWN = {  # solvers that the profiles name; the others are thin grey lines
    "auto": "Auto (the default of files)",
    "nlgs": "NLGS, sweeps",
    "nlgs_anderson": "NLGS, Anderson",
    "ppa_newton": "PPANewton",
    "newton_alart_curnier": "Newton, Alart-Curnier",
    "admm": "ADMM",
    "interior_point": "interior point",
    "Siconos NSGS": "Siconos NSGS",
    "Siconos NSN-AC": "Siconos NSN-AC",
    "Siconos ADMM": "Siconos ADMM",
}


def draw(rows, path):
    """Performance profiles (Dolan & More 2002): share of the problems solved within a factor of the fastest."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams["font.size"] = 12
    figure, axes = plt.subplots(1, 2, figsize=(11, 6.2), sharey=True, layout="constrained")
    for ax, tol in zip(axes, TOLERANCES, strict=True):
        here = [r for r in rows if r["tol"] == tol]
        names = list(dict.fromkeys(r["problem"] for r in here))
        least = {n: min((r["seconds"] for r in here if r["problem"] == n and r["seconds"]), default=np.nan) for n in names}
        curves = {}
        for code, solver in dict.fromkeys((r["code"], r["solver"]) for r in here):
            mine = [r for r in here if (r["code"], r["solver"]) == (code, solver)]
            ratios = np.sort([r["seconds"] / least[r["problem"]] for r in mine if r["seconds"]])
            shares = np.append(np.arange(1, ratios.size + 1), ratios.size) / len(names)
            curves[solver if code == "cairn" else f"Siconos {solver}"] = (np.append(ratios, 1e3), shares)
        for name, curve in curves.items():
            if name not in SHOWN:
                ax.step(*curve, where="post", color="0.85", lw=0.8)
        ax.plot([], [], color="0.85", lw=0.8, label="other solvers")
        for k, (name, told) in enumerate(SHOWN.items()):
            style = "--" if name.startswith("Siconos") else "-"
            ax.step(*curves[name], where="post", color=f"C{k}", ls=style, lw=3 if name == "auto" else 1.6, label=told)
        ax.set(
            xscale="log",
            xlim=(1, 1e3),
            ylim=(0, 1.02),
            xlabel="CPU time over that of the fastest solver [-]",
            title=f"solved to an error of {tol:.0e}",
        )
    axes[0].set_ylabel(f"share of {len(names)} problems solved [-]")
    handles, told = axes[1].get_legend_handles_labels()
    figure.legend(handles[1:] + handles[:1], told[1:] + told[:1], loc="outside lower center", ncols=4, frameon=False, fontsize=11)
    figure.savefig(path, dpi=110)


def stored():
    """Rows of results/problems.csv, numbers as numbers and an unsolved problem without seconds."""
    with open(HERE / "results" / "problems.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{**row, "tol": float(row["tol"]), "seconds": float(row["seconds"] or 0)} for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", help="folder of the answers of problems_siconos.py")
    parser.add_argument("--write", metavar="FOLDER", help="write the problems as text, and end")
    parser.add_argument("--cap", type=float, default=0.3, help="CPU seconds at most for a solver; auto has ten times as many")
    parser.add_argument("--solvers", nargs="+", help="of ours; problems without a peer's answers are left out then")
    parser.add_argument("--output", type=Path, help="CSV to write instead of the table and the profiles")
    parser.add_argument("--draw", action="store_true", help="draw the profiles anew from results/problems.csv, without measuring")
    options = parser.parse_args()
    if options.draw:
        draw(stored(), HERE.parent / "docs" / "images" / "problems_profiles.png")
        return
    if options.write:
        for path in DATA.glob("*.hdf5"):
            problems.text.write(Path(options.write) / f"{path.stem}.dat", problems.read(path))
        return
    rows = measure(options.peers, options.cap, options.solvers)
    with open(options.output or HERE / "results" / "problems.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    if options.output:
        print(table(rows))
        return
    (HERE.parent / "docs" / "problems_table.md").write_text("# Solvers side by side\n\n" + table(rows), encoding="utf-8")
    draw(rows, HERE.parent / "docs" / "images" / "problems_profiles.png")


if __name__ == "__main__":
    main()
