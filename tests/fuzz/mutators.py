"""Ways to damage a file: by bytes, by words of a text, and by structure with seals made right again. chance: random.Random."""

import re

from cairn import _core

ODD = ["-1", "0", "1", "2147483648", "-9223372036854775808", "1e999", "nan", "-inf", "1e-320", "", "x", "é", "9" * 20]


def bytes_of(data, chance):
    """Damages bytes at random: (name of the damage, new bytes)."""
    data = bytearray(data)
    how = chance.choice(["bit", "bit", "bytes", "bytes", "noughts", "ones", "cut", "twice", "gone", "number"])
    at = chance.randrange(max(len(data), 1))
    size = min(chance.choice([1, 2, 4, 8, 16, 48, 64, 512]), max(len(data) - at, 1))
    if not data:
        return "empty", b""
    if how == "bit":
        data[at] ^= 1 << chance.randrange(8)
    elif how == "bytes":
        data[at : at + size] = chance.randbytes(size)
    elif how in ("noughts", "ones"):
        data[at : at + size] = (b"\0" if how == "noughts" else b"\xff") * size
    elif how == "cut":
        del data[at:]
    elif how == "twice":
        data[at:at] = data[at : at + size]
    elif how == "gone":
        del data[at : at + size]
    else:
        value = chance.choice([0, 1, -1, 2**31 - 1, 2**63 - 1, -(2**63), len(data), at])
        data[at : at + 8] = int(value).to_bytes(8, "little", signed=True)
    return f"{how} at {at}, {size} bytes", bytes(data)


def words_of(data, chance):
    """One word, or line, of a text is another, gone or there twice."""
    how = chance.choice(["word", "word", "word", "word gone", "line gone", "line twice", "lines changed", "long"])
    if how.startswith("line"):
        lines = data.splitlines(keepends=True)
        at = chance.randrange(max(len(lines), 1))
        if not lines:
            return "empty", b""
        if how == "line gone":
            del lines[at]
        elif how == "line twice":
            lines.insert(at, lines[at])
        else:
            other = chance.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
        return f"{how}: {at}", b"".join(lines)
    words = list(re.finditer(rb"\S+", data[:200_000]))
    if not words:
        return "empty", data
    word = chance.choice(words)
    new = b"" if how == "word gone" else b"7" * 5000 if how == "long" else chance.choice(ODD).encode()
    return f"{word[0][:20]!r} at {word.start()} is {new[:20]!r}", data[: word.start()] + new + data[word.end() :]


def headers_of(data, chance):
    """A byte of a header of HDF5 (version 2) is another, and its checksum is right again."""
    data = bytearray(data)
    starts = [m.start() for m in re.finditer(rb"OHDR\x02\x02", data)]
    if not starts:
        return bytes_of(data, chance)
    at = chance.choice(starts)
    end = at + 10 + int.from_bytes(data[at + 6 : at + 10], "little")
    if end + 4 > len(data):
        return bytes_of(data, chance)
    place = chance.randrange(at + 10, end)
    how = chance.choice(["byte", "number", "noughts"])
    if how == "byte":
        data[place] = chance.choice([0, 1, 0xFF, data[place] ^ 1 << chance.randrange(8)])
    elif how == "number":
        room = min(8, end - place)
        value = chance.choice([0, 1, 2**63 - 1, 2**40, len(data), at])
        data[place : place + room] = value.to_bytes(8, "little")[:room]
    else:
        room = min(chance.choice([8, 16, 40]), end - place)
        data[place : place + room] = bytes(room)
    data[end : end + 4] = _core.lookup3(bytes(data[at:end])).to_bytes(4, "little")
    return f"{how} at {place} of the header at {at}", bytes(data)


def trees_of(data, chance):
    """A number of a B-tree, or of the beginning of the file with its checksum made right again, is another."""
    data = bytearray(data)
    starts = [m.start() for m in re.finditer(b"TREE|SNOD|HEAP|GCOL", data)] + [0]
    at = chance.choice(starts)
    place = at + 8 * chance.randrange(6) if at else chance.choice([28, 36])
    value = chance.choice([0, 1, 2**63 - 1, at, len(data), len(data) - 8, *starts])
    data[place : place + 8] = value.to_bytes(8, "little")
    if not at:
        data[44:48] = _core.lookup3(bytes(data[:44])).to_bytes(4, "little")
    return f"{value} at {place}", bytes(data)
