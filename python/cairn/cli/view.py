"""`cairn view`: a run turned round in the browser, in a window, or written as a page of its own."""


def add_parser(add, commands):
    """The parser of `cairn view`."""
    view = add(
        commands,
        "view",
        "show a run in 3D: in the browser, in a window, or as a page that works without a server",
        "cairn view pile.vtkhdf                     in the browser (needs trame), also while the run goes on\n"
        "cairn view pile.vtkhdf --html pile.html    one page with all in it, to send to a colleague\n"
        "cairn view pile.vtkhdf --window --what material",
    )
    view.add_argument("file", help="a .vtkhdf file")
    view.add_argument("--what", default="velocity", help="field that colours the bodies (default: velocity)")
    view.add_argument("--html", metavar="PAGE", help="write a self-contained page instead: play, colours, forces, cuts, numbers")
    view.add_argument("--every", type=int, default=1, help="page: each N-th output (default: 1)")
    view.add_argument("--fields", nargs="+", metavar="FIELD", help="page: fields to include (default: all)")
    view.add_argument("--overwrite", action="store_true", help="replace the page if it is there")
    view.add_argument("--window", action="store_true", help="in a window of PyVista instead of the browser")
    view.add_argument("--port", type=int, default=0, help="port of the local server (default: a free one)")
    view.add_argument("--no-browser", action="store_true", help="serve, but open no browser")


def main(options):
    """`cairn view`."""
    from ..base import checks
    from ..post.load import load

    checks.count("every", options.every, 1)
    checks.count("port", options.port, 0, 65535)
    if not options.html and (options.fields or options.every > 1 or options.overwrite):
        word = "--fields" if options.fields else "--every" if options.every > 1 else "--overwrite"
        raise ValueError(f"{word} is for a page: give --html PAGE too, or leave it out")
    if options.html:
        from ..post.view.page import write_page

        with load(options.file) as run:
            print(write_page(run, options.html, options.what, options.every, options.fields, options.overwrite))
        return 0
    if options.window:
        from ..post.plots3d import view as show

        with load(options.file) as run:
            show(run, options.what)
        return 0
    from ..post.view.live import serve

    serve(options.file, options.what, port=options.port, open_browser=not options.no_browser)
    return 0
