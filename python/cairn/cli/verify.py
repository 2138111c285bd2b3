"""`cairn verify`: two runs compared."""

from .errors import save_picture


def add_parser(add, commands):
    """The parser of `cairn verify`."""
    check = add(
        commands,
        "verify",
        "compare two runs body by body and contact by contact",
        "cairn verify pile.vtkhdf again.vtkhdf\n"
        "cairn verify lmgc90_case/ pile.vtkhdf --tol position=1e-3 --tol total_force=0.01 -o divergence.png\n"
        "exit status: 0 the runs agree, 3 they differ, 1 a file cannot be read",
    )
    check.add_argument("a", help="a .vtkhdf file, an lmgc90.h5, or a folder with DATBOX and OUTBOX")
    check.add_argument("b", help="the other")
    check.add_argument("--tol", action="append", metavar="NAME=VALUE", help="largest value of a norm (default: position=1e-4)")
    check.add_argument("--until", type=float, help="ignore later instants [s]")
    check.add_argument("--size", type=float, help="size of a body [m] (default: median radius of A, half the extent of a mesh)")
    check.add_argument("-o", "--output", help="picture of the divergence over time")
    check.add_argument("--csv", help="write the norms at all common instants")


def main(options):
    """`cairn verify`."""
    from ..base import checks
    from ..post.verify import verify as compare

    if options.size is not None:
        checks.positive("size", options.size)
    if options.until is not None:
        checks.number("until", options.until)
    tolerances = None
    if options.tol:
        words = [t.partition("=") for t in options.tol]
        try:
            tolerances = {name: float(value) for name, _, value in words}
        except ValueError:
            raise ValueError(f"--tol {' '.join(options.tol)}: write NAME=VALUE, as in position=1e-4") from None
    result = compare(options.a, options.b, tolerances, until=options.until, size=options.size)
    print(result.table())
    if options.csv:
        import csv

        with open(options.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, list(result.rows[0]))
            writer.writeheader()
            writer.writerows(result.rows)
    if options.output:
        import matplotlib

        matplotlib.use("Agg")
        save_picture(result.plot(), options.output, 120)
        print(options.output)
    return 0 if result.agrees else 3
