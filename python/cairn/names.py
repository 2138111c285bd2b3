"""Names that users type: what exists, and what was probably meant; arguments, arrays, materials, solvers, commands."""

from __future__ import annotations

import difflib
import functools
import inspect
import sys
import types


def nearest(word, known):
    """The known name that is most like the word, however it is written; None if none is like it."""
    by_small, word = {str(name).lower(): str(name) for name in known}, str(word).lower()
    found = difflib.get_close_matches(word, by_small, 1)
    if not found and word:  # tolerance for tol, dir for direction
        found = [name for name in by_small if min(len(name), len(word)) > 2 and (word.startswith(name) or name.startswith(word))]
    return by_small[found[0]] if found else None


def meant(word, known):
    """'; did you mean 'theta'?' for the end of a message, or nothing."""
    found = nearest(word, known)
    return f"; did you mean {found!r}?" if found else ""


def listed(known, word=None):
    """'theta, solver', or 'none'; and what may have been meant by a word that is not among them."""
    known = [str(name) for name in known]
    return (", ".join(known) or "none") + ("" if word is None else meant(word, known))


def one_of(name, value, known):
    """The value itself; ValueError unless it is one of the known words."""
    if not isinstance(value, str) or value not in known:
        words = [repr(word) for word in known]
        choice = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
        raise ValueError(f"{name} is {value!r}: give {choice}{meant(value, known)}")
    return value


def takes(*known):
    """Decorator of a function with **options: the names that these may have."""

    def mark(function):
        function.known_options = known
        return function

    return mark


def telling(function, called=None):
    """The function; a call with wrong arguments says what is right and what may have been meant, in a TypeError."""
    signature = inspect.signature(function)
    parameters = [p for p in signature.parameters.values() if p.name != "self"]
    more = getattr(function, "known_options", ())
    known = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    known += [name for name in more if name not in known]
    open_ended = not more and any(p.kind == p.VAR_KEYWORD for p in parameters)
    allowed = frozenset(known)

    def name(given):  # of a constructor the class at hand, which may be derived from the one that has it
        return type(given[0]).__name__ if function.__name__ == "__init__" else called or function.__name__

    @functools.wraps(function)
    def told(*given, **named):
        if not open_ended and not allowed.issuperset(named):
            wrong = next(word for word in named if word not in allowed)
            raise TypeError(f"{name(given)} has no argument {wrong!r}; it has {listed(known, wrong)}")
        try:
            return function(*given, **named)
        except TypeError:
            unfit = _unfit(signature, given, named)
            if unfit is None:
                raise
            raise TypeError(f"{name(given)}: {unfit}; the call is {name(given)}{_call(parameters)}") from None

    return told


def _unfit(signature, given, named):
    """Why a call does not fit a signature; None if it does."""
    try:
        signature.bind(*given, **named)
    except TypeError as error:
        return str(error)
    return None


def _call(parameters):
    """'(centers, radii, material, *, density=None)'."""
    plain = []
    for p in parameters:
        default = p.default if isinstance(p.default, (type(None), bool, int, float, str, tuple)) or p.default is p.empty else ...
        plain.append(p.replace(annotation=p.empty, default=default))
    return str(inspect.Signature(plain))


def teach(namespace, public=None, package="cairn"):
    """Puts `telling` around the public functions, constructors and methods of a namespace, a dict, wherever they are defined.

    public: their names; without it, all that the module of the namespace defines.
    """
    if public is None:
        own = namespace["__name__"]
        public = [n for n, member in namespace.items() if n[0] != "_" and getattr(member, "__module__", None) == own]
    for name in public:
        member = namespace.get(name)
        if getattr(member, "__module__", "").partition(".")[0] != package:
            continue
        if isinstance(member, types.FunctionType):
            if not hasattr(member, "__wrapped__"):
                home = vars(sys.modules[member.__module__])
                namespace[name] = told = telling(member)
                if home.get(member.__name__) is member:
                    home[member.__name__] = told
        elif isinstance(member, type):
            for cls in member.__mro__[:-1]:
                _teach_class(cls)


def _teach_class(cls):
    if "_told_of" in vars(cls) or issubclass(cls, BaseException) or cls.__module__.partition(".")[0] != "cairn":
        return
    for name, member in list(vars(cls).items()):
        if isinstance(member, types.FunctionType) and not hasattr(member, "__wrapped__"):
            if name == "__init__" or not name.startswith("_"):
                setattr(cls, name, telling(member, f"{cls.__name__}.{name}"))
    cls._told_of = True
