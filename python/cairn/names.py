"""Checks of names that users type (arguments, arrays, materials, solvers, commands), with suggestions for misspelt ones."""

from __future__ import annotations

import difflib
import functools
import inspect
import sys
import types
from collections.abc import Callable
from typing import TypeVar

Taker = TypeVar("Taker", bound=Callable)
# {name in other programs: name here}
ELSEWHERE = {
    "colormap": "cmap", "colourmap": "cmap", "color_map": "cmap", "colour_map": "cmap", "palette": "cmap", "colors": "cmap",
    "clim": "limits", "vmin": "limits", "vmax": "limits", "color_limits": "limits", "ax_title": "title", "axis": "ax",
    "axes": "ax", "xlim": "view", "ylim": "view", "fixed": "driven", "framerate": "fps", "duration": "fps",
    **dict.fromkeys(("field", "fields", "quantity", "variable", "scalars", "color", "colour", "color_by", "colour_by"), "what"),
}  # fmt: skip


def nearest(word, known):
    """Known name most similar to a word, ignoring case; None if none is similar."""
    by_small, word = {str(name).lower(): str(name) for name in known}, str(word).lower()
    if word not in by_small and ELSEWHERE.get(word) in by_small:
        return by_small[ELSEWHERE[word]]
    begun = [name for name in by_small if len(word) > 3 and name.startswith(word)]  # Hertz for HertzMindlin
    found = begun[:1] if len(begun) == 1 else difflib.get_close_matches(word, by_small, 1)
    if not found and word:  # tolerance for tol, dir for direction
        found = [name for name in by_small if min(len(name), len(word)) > 2 and (word.startswith(name) or name.startswith(word))]
    return by_small[found[0]] if found else None


def meant(word, known):
    """Suggestion '; did you mean 'theta'?' for the end of a message; empty without a similar name."""
    found = nearest(word, known)
    return f"; did you mean {found!r}?" if found else ""


def listed(known, word=None):
    """Known names as 'theta, solver', or 'none', followed by a suggestion for a word that is not among them."""
    known = [str(name) for name in known]
    return (", ".join(known) or "none") + ("" if word is None else meant(word, known))


def one_of(name, value, known):
    """Returns the value. Raises ValueError unless it is among the known words."""
    if not isinstance(value, str) or value not in known:
        words = [repr(word) for word in known]
        choice = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
        raise ValueError(f"{name} is {value!r}: give {choice}{meant(value, known)}")
    return value


def takes(*known: str) -> Callable[[Taker], Taker]:
    """Decorator that sets the allowed names of the **options of a function."""

    def mark(function):
        function.known_options = known
        return function

    return mark


class Spelt:
    """Base of classes that refuse assignment to misspelt attributes, instead of creating new ones.

    Names that are not similar to those of the object are taken for the user's own attributes, and may be set.
    """

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise AttributeError(f"{type(self).__name__} has no {name!r}{self._elsewhere(name) or meant(name, dir(self))}")

    def __setattr__(self, name, value):
        if name[0] != "_" and name not in self.__dict__:
            held = getattr(type(self), name, None)
            if isinstance(held, property) and held.fset is None:
                remedy = self._elsewhere(name).removeprefix("; ") or "it is what was found or chosen"
                what = f"{name} of {type(self).__name__} is {getattr(self, name)!r}"
                raise AttributeError(f"{what} and cannot be assigned: {remedy}")
            if held is None and vars(self).get("_made"):
                known = [word for word in dir(self) if word[0] != "_"]
                like = difflib.get_close_matches(name, known, 1, 0.8)
                told = self._elsewhere(name) or (f"; did you mean {like[0]!r}?" if like else "")
                if told:
                    raise AttributeError(f"{type(self).__name__} has no {name!r} to be assigned{told}")
        object.__setattr__(self, name, value)

    def _elsewhere(self, name):
        """Hint where a missing or fixed attribute is found or changed: '; give ...'; empty without."""
        return ""


def _frozen(self, name, value):
    from dataclasses import FrozenInstanceError, fields

    known = [field.name for field in fields(self)]
    own = type(self).__name__
    what = f"{name} is {getattr(self, name)!r}" if name in known else f"{own} has no {name!r}{meant(name, known)}"
    raise FrozenInstanceError(f"{what}: a {own} does not change; make another, {own}({name}=...)")


def within(what, parts, name):
    """Suggestion '; did you mean sim.bodies.velocity?' if a part of an object has this name or a similar name; else empty.

    what: name of the object, such as 'sim'; parts: {name of a part: the part}."""
    known = {}
    for part, held in parts.items():
        known |= {word: part for word in (*getattr(held, "names", ()), *dir(held)) if word[0] != "_"}
    like = name if name in known else next(iter(difflib.get_close_matches(name, known, 1, 0.8)), None)
    return "" if like is None else f"; did you mean {what}.{known[like]}.{like}?"


def telling(function, called=None):
    """Wraps a function so that a call with wrong arguments raises a TypeError with the right ones and a suggestion. called: name
    of the function in messages."""
    signature = inspect.signature(function)
    parameters = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
    more = getattr(function, "known_options", ())
    known = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    known += [name for name in more if name not in known]
    open_ended = not more and any(p.kind == p.VAR_KEYWORD for p in parameters)
    allowed = frozenset(known)

    def name(given):  # for a constructor the class of the object, which may be derived
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


def by_name(parameters):
    """Signature with keyword-only parameters. parameters: rows (name, default or None, ...)."""
    kind, empty = inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.empty
    words = [inspect.Parameter(row[0], kind, default=empty if row[1] is None else row[1]) for row in parameters]
    return inspect.Signature(words)


def _unfit(signature, given, named):
    """Text on why a call does not fit a signature; None if it does."""
    try:
        signature.bind(*given, **named)
    except TypeError as error:
        return str(error)
    return None


def _call(parameters):
    """Text of a signature, such as '(centers, radii, material, *, density=None)'."""
    plain = []
    for p in parameters:
        default = p.default if isinstance(p.default, (type(None), bool, int, float, str, tuple)) or p.default is p.empty else ...
        plain.append(p.replace(annotation=p.empty, default=default))
    return str(inspect.Signature(plain))


def parameters_section(rows):
    """Lines of the section Parameters of a docstring; none without parameters. rows: (name, type, text) of each."""
    if not rows:
        return []
    told = (line for name, kind, text in rows for line in (f"{name} : {kind}", f"    {text[0].upper()}{text[1:]}."))
    return ["", "Parameters", "----------", *told]


def teach(namespace, public=None, package="cairn"):
    """Wraps the public functions, constructors and methods of a namespace (a dict) by `telling`, wherever they are defined.

    public: their names; by default all that the module of the namespace defines.
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
    if getattr(vars(cls).get("__dataclass_params__"), "frozen", False):
        cls.__setattr__ = _frozen
    for name, member in list(vars(cls).items()):
        if isinstance(member, types.FunctionType) and not hasattr(member, "__wrapped__"):
            if name == "__init__" or not name.startswith("_"):
                setattr(cls, name, telling(member, f"{cls.__name__}.{name}"))
        elif isinstance(member, (classmethod, staticmethod)) and not name.startswith("_"):
            inner = member.__func__
            if isinstance(inner, types.FunctionType) and not hasattr(inner, "__wrapped__"):
                setattr(cls, name, type(member)(telling(inner, f"{cls.__name__}.{name}")))
    cls._told_of = True
