"""`cairn wrap-law interface.toml`: an adapter that calls an existing scalar routine, contact by contact, as a contact law.

The interface lists the arguments of the routine:

    name = "old_law"                        # of the law in Cairn
    routine = "OLDLAW"                      # a Fortran routine; language = "c" for one of C
    sources = ["oldlaw.f"]
    slot = "solve"                          # impulses of one contact; or "prepare": bias and friction of the cone
    arguments = ["u1", "u2", "w11", "w22", "mu", "r1", "r2", "status:int"]
    parameters = "mu::0:inf"
    components = [2, 0]                     # unknowns in 2D and in 3D, 0: not available
    thread_safe = false                     # SAVE, COMMON, static data: one call at a time
    isolate = true                          # in a process of its own: its STOP becomes an error message
    init = "OLDINI"                         # a routine to be called once, before the first contact
    deck = "steel.dat"                      # its argument, the path of a file (CHARACTER*(*), const char*); without it none
    time_limit = 60                         # seconds after which a call of that process is stopped, default 60

Words of solve: u1.. relative velocity without this contact, bias included, normal first; w11.. Delassus block; bias1..; r1.. out;
status out (0 open, 1 stick, 2 slip); names of parameters and of state variables. Words of prepare: gap, h, theta, u1.. at the
start of the step; out: bias1.., compliance1.., mu; names of parameters; state variables in and out. Other words must be numbers,
which are passed unchanged. `:int`, `:float` set the type (double without); `:value` after it passes by value.
"""

from __future__ import annotations

import re
import shlex
import tomllib
from importlib.resources import files
from pathlib import Path

TYPES = {"double": "double", "float": "float", "int": "int32_t"}
KEYS = set(
    "name routine language sources slot arguments parameters state components thread_safe isolate time_limit init deck".split()
)


def wrap_law(interface, folder=None, **changes):
    """Writes the adapter beside the interface (or into folder); returns its path and the command that builds the library.

    interface: path of a .toml file. changes: keys that replace those of the file, such as isolate=True. Raises ValueError naming
    the wrong key and the remedy.
    """
    path = Path(interface)
    try:
        given = tomllib.loads(path.read_text(encoding="utf-8")) | changes
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path}: this is no TOML ({error}); see 'cairn wrap-law --help'") from error
    wrong = sorted(set(given) - KEYS)
    if wrong:
        raise ValueError(f"{path}: there is no key {wrong[0]!r}; there are {', '.join(sorted(KEYS))}")
    for key in ("name", "routine", "slot", "arguments"):
        if key not in given:
            raise ValueError(f"{path}: key {key!r} is missing; see `cairn wrap-law --help`")
    for key in ("name", "routine", *(["init"] if "init" in given else [])):
        if not re.fullmatch(r"[A-Za-z_]\w{0,59}", given[key]):
            raise ValueError(f"{path}: {key} is {given[key]!r}: give a name of letters, digits and _")
    if given["slot"] not in ("solve", "prepare"):
        raise ValueError(f"{path}: slot is {given['slot']!r}: give 'solve' or 'prepare'")
    for key in ("isolate", "thread_safe"):
        if not isinstance(given.get(key, False), bool):
            raise ValueError(f"{path}: {key} is {given[key]!r}: give true or false, without quotes")
    limit = given.get("time_limit", 60)
    if isinstance(limit, bool) or not isinstance(limit, (int, float)) or not 0 < limit <= 1e6:
        raise ValueError(f"{path}: time_limit is {limit!r}: give seconds, more than 0 and at most 1e6")
    if "time_limit" in given and not given.get("isolate", False):
        raise ValueError(f"{path}: time_limit is that of a routine in a process of its own: give isolate = true, too")
    if "deck" in given:
        given["deck"] = _deck(path, given)
    text = _adapter(path, given)
    target = Path(folder or path.parent) / f"{given['name']}_adapter.c"
    target.write_text(text, encoding="utf-8")
    here = target.parent.resolve() == Path.cwd()
    return target, ("" if here else f"cd {shlex.quote(str(target.parent))} && ") + _build(given)


def _deck(path, given):
    """Absolute path of the deck, so that it is found from every folder."""
    if "init" not in given:
        raise ValueError(f"{path}: deck is {given['deck']!r}, and there is no init: name the routine that reads it")
    deck = (path.parent / given["deck"]).resolve()
    if not deck.is_file():
        raise ValueError(f"{path}: deck is {given['deck']!r}: there is no file {deck}; a path is relative to the interface")
    return str(deck)


def _build(given):
    sources = " ".join(shlex.quote(source) for source in given.get("sources", []))
    name = given["name"]
    return f"gcc -O2 -fPIC -c {name}_adapter.c && gfortran -O2 -shared -fPIC {name}_adapter.o {sources} -o lib{name}.so"


def _adapter(path, given):
    components = given.get("components", [2, 3])
    names = [p.split(":")[0] for p in given.get("parameters", "").split()]
    states = [s.split(":")[0] for s in given.get("state", "").split()]
    slot, most = given["slot"], max(components)
    lines, declaration = _call(path, given, _words(slot, most, names, states))
    fortran = given.get("language", "fortran") == "fortran"
    symbol = given["routine"].lower() + "_" if fortran else given["routine"]
    begin, init = _begin(given, fortran)
    values = {
        "BEGIN": begin,
        "NAME": given["name"],
        "ROUTINE": given["routine"],
        "BUILD": _build(given),
        "DECLARATION": f"extern void {symbol}({', '.join(declaration)});{init}",
        "ISOLATE": str(int(bool(given.get("isolate", False)))),
        "TIME_LIMIT": repr(float(given.get("time_limit", 60))),
        "PARAMETER_COUNT": str(len(names)),
        "STATE_COUNT": str(len(states)),
        "SOLVE": "\n".join(lines) if slot == "solve" else "    r[i] = status[i] = 0;",
        "PREPARE": "\n".join(lines) if slot == "prepare" else "",
        "USES_PREPARE": str(int(slot == "prepare")),
        "USES_SOLVE": str(int(slot == "solve")),
        "C2": str(components[0]),
        "C3": str(components[1]),
        "THREAD_UNSAFE": str(int(not given.get("thread_safe", False) or bool(given.get("isolate", False)))),
        "PARAMETERS": given.get("parameters", ""),
        "STATE": given.get("state", ""),
    }
    text = (files("cairn") / "plugs" / "adapter.c.in").read_text(encoding="utf-8")
    return re.sub(r"@([A-Z0-9_]+)@", lambda m: values[m[1]], text)


def _begin(given, fortran):
    """Call of the routine init in C, and its declaration; a CHARACTER argument of Fortran has its length behind all others."""
    if "init" not in given:
        return "", ""
    symbol, deck = given["init"].lower() + "_" if fortran else given["init"], given.get("deck")
    if deck is None:
        return f"{symbol}();", f"\nextern void {symbol}(void);"
    text = '"' + deck.replace("\\", "\\\\").replace('"', '\\"') + '"'
    length = f", (size_t){len(deck.encode())}" if fortran else ""
    return f"{symbol}({text}{length});", f"\nextern void {symbol}(const char*{', size_t' if fortran else ''});"


def _words(slot, most, names, states):
    """{word: (C expression, True for an output)}."""
    words = {name: (f"params[i + n * {k}]", False) for k, name in enumerate(names)}
    words |= {name: (f"state[i + n * {k}]", slot == "prepare") for k, name in enumerate(states)}
    for k in range(most):
        words[f"u{k + 1}"] = (f"u[i + n * {k}]", False)
        words[f"bias{k + 1}"] = (f"bias[i + n * {k}]", slot == "prepare")
        if slot == "solve":
            words[f"r{k + 1}"] = (f"r[i + n * {k}]", True)
            words |= {f"w{k + 1}{j + 1}": (f"w[i + n * ({k} + c * {j})]", False) for j in range(most)}
        else:
            words[f"compliance{k + 1}"] = (f"compliance[i + n * {k}]", True)
    if slot == "solve":
        words["status"] = ("status[i]", True)
    else:
        words |= {"gap": ("gap[i]", False), "h": ("h", False), "theta": ("theta", False)}
        words.setdefault("mu", ("mu[i]", True))
        words["friction"] = ("mu[i]", True)
    return words


def _call(path, given, words):
    """Lines of C that call the routine for contact i, and its declaration."""
    symbol = given["routine"].lower() + "_" if given.get("language", "fortran") == "fortran" else given["routine"]
    before, after, passed, declaration = [], [], [], []
    for k, argument in enumerate(given["arguments"]):
        word, *options = argument.split(":")
        kind = next((o for o in options if o in TYPES), "double")
        if set(options) - set(TYPES) - {"value"}:
            raise ValueError(f"{path}: argument {argument!r} has an option that is not int, float, double or value")
        if word in words:
            expression, out = words[word]
        elif re.fullmatch(r"[-+]?[\d.]+(e[-+]?\d+)?", word):
            expression, out = word, False
        else:
            raise ValueError(f"{path}: argument {word!r} of slot {given['slot']} is no number and none of {', '.join(words)}")
        before.append(f"    {TYPES[kind]} a{k} = ({TYPES[kind]}){expression};")
        by_value = "value" in options
        passed.append(f"a{k}" if by_value else f"&a{k}")
        declaration.append(TYPES[kind] if by_value else f"{TYPES[kind]}*")
        if out and not by_value:
            after.append(f"    {expression} = a{k};")
    if not after:
        raise ValueError(f"{path}: arguments give nothing back: one of r1.., bias1.. is needed")
    begin = ["    status[i] = 0;", "    for (int32_t k = 0; k < c; ++k) if (!isfinite(r[i + n * k])) r[i + n * k] = 0;"]
    begin = begin if given["slot"] == "solve" else []
    finish = [] if given["slot"] == "prepare" or any(a.split(":")[0] == "status" for a in given["arguments"]) else [
        "    status[i] = r[i] > 0 ? 2 : 0;"
    ]  # fmt: skip
    return [*begin, *before, f"    {symbol}({', '.join(passed)});", *after, *finish], declaration
