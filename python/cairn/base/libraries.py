"""Libraries that are imported only when used."""

import contextlib
import importlib
import io


def library(name, purpose):
    """A library that is imported only when used."""
    try:
        return importlib.import_module(name)
    except ImportError:
        package = name.partition(".")[0]  # pip knows the whole by its first name
        raise ImportError(f"{package} is needed {purpose}: pip install {package}") from None
    except OSError as error:  # it is there, and a library of the system that it rests on is not
        raise ImportError(f"{name} is needed {purpose}, and cannot be loaded ({error}): install what it names") from None


def by_library(path, read):
    """Reads by a library, which may raise any exception and even exit; its messages are kept from the screen."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return read(path)
    except (Exception, SystemExit) as error:
        words = " ".join(said.getvalue().split()) if isinstance(error, SystemExit) else f"{type(error).__name__}: {error}"
        raise ValueError(f"{path.name} cannot be read as {path.suffix}: {words}") from None
