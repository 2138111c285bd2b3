"""The bytes of HDF5 structures that a growing file needs, after the HDF5 File Format Specification, version 3.0.

Only what `container` writes: superblock 2, object headers 2, compact links, contiguous and chunked storage with a
version 1 B-tree. All of it is read by HDF5 1.8 and later. Sizes of offsets and lengths are 8 bytes, little endian.
"""

import struct

import numpy as np

UNDEFINED = 0xFFFFFFFFFFFFFFFF
SUPERBLOCK_SIZE = 48
CHILDREN = 64  # of a B-tree node: twice the default K of 32 that a superblock without extension implies

_DATASPACE, _LINK_INFO, _DATATYPE, _FILL_VALUE, _LINK, _LAYOUT, _GROUP_INFO, _ATTRIBUTE = 1, 2, 3, 5, 6, 8, 10, 12
_MASK = 0xFFFFFFFF


def checksum(data, state=None):
    """Jenkins' lookup3 hash of bytes, initial value 0 (Jenkins 2006): the checksum of HDF5 metadata.

    state : what `checksum_state` gave for the beginning of data, to hash the rest alone.
    """
    done, a, b, c = state or (0, *([(0xDEADBEEF + len(data)) & _MASK] * 3))
    if not data:
        return c
    padded = data + bytes(-len(data) % 12)
    words = struct.unpack_from(f"<{(len(padded) - done) // 4}I", padded, done)
    a, b, c = _mix(words[:-3], a, b, c)
    a, b, c = (a + words[-3]) & _MASK, (b + words[-2]) & _MASK, (c + words[-1]) & _MASK
    for x in (14, 11, 25, 16, 4, 14, 24):
        # the final mix turns the roles round: c, a, b, c, a, b, c
        c = ((c ^ b) - (b << x & _MASK | b >> (32 - x))) & _MASK
        a, b, c = b, c, a
    return b


def checksum_state(beginning, length):
    """State of the hash after the whole blocks of `beginning`, which is to be followed by more, to `length` bytes."""
    done = len(beginning) // 12 * 12
    start = (0xDEADBEEF + length) & _MASK
    return done, *_mix(struct.unpack_from(f"<{done // 4}I", beginning), start, start, start)


def _mix(words, a, b, c):
    for i in range(0, len(words), 3):
        a, b, c = (a + words[i]) & _MASK, (b + words[i + 1]) & _MASK, (c + words[i + 2]) & _MASK
        a = (a - c) & _MASK ^ (c << 4 & _MASK | c >> 28)
        c = (c + b) & _MASK
        b = (b - a) & _MASK ^ (a << 6 & _MASK | a >> 26)
        a = (a + c) & _MASK
        c = (c - b) & _MASK ^ (b << 8 & _MASK | b >> 24)
        b = (b + a) & _MASK
        a = (a - c) & _MASK ^ (c << 16 & _MASK | c >> 16)
        c = (c + b) & _MASK
        b = (b - a) & _MASK ^ (a << 19 & _MASK | a >> 13)
        a = (a + c) & _MASK
        c = (c - b) & _MASK ^ (b << 4 & _MASK | b >> 28)
        b = (b + a) & _MASK
    return a, b, c


def superblock(root, end):
    """Superblock of a file whose root group's header is at `root` and whose last byte is before `end`."""
    body = b"\x89HDF\r\n\x1a\n" + struct.pack("<BBBBQQQQ", 2, 8, 8, 0, 0, UNDEFINED, end, root)
    return body + struct.pack("<I", checksum(body))


def datatype(dtype, ascii=False):
    """Datatype message of a numpy dtype: integers, floats, fixed strings (UTF-8, or marked as ASCII)."""
    dtype, size = np.dtype(dtype), np.dtype(dtype).itemsize
    if dtype.kind in "iu":
        return struct.pack("<BBBBIHH", 0x10, 8 if dtype.kind == "i" else 0, 0, 0, size, 0, 8 * size)
    if dtype.kind == "f" and size in (4, 8):
        exponent, mantissa, bias = {4: (8, 23, 127), 8: (11, 52, 1023)}[size]
        return struct.pack("<BBBBIHHBBBBI", 0x11, 0x20, 8 * size - 1, 0, size, 0, 8 * size, mantissa, exponent, 0, mantissa, bias)
    if dtype.kind == "S":
        return struct.pack("<BBBBI", 0x13, 1 if ascii else 0x11, 0, 0, size)  # null-padded
    raise TypeError(f"an array of {dtype} cannot be stored; use integers, float32, float64 or strings")


def dataspace(shape, extendable=False):
    """Dataspace message; an extendable one has no limit along its first axis."""
    shape = tuple(int(n) for n in shape)
    head = struct.pack("<BBBB", 2, len(shape), 1 if extendable else 0, 1 if shape else 0)
    limits = (UNDEFINED, *shape[1:]) if extendable else ()
    return head + struct.pack(f"<{len(shape) + len(limits)}Q", *shape, *limits)


def attribute(name, value):
    """Attribute message; `value` an array that `storable` has passed."""
    label, space = name.encode() + b"\0", dataspace(value.shape)
    kind = datatype(value.dtype, ascii=value.tobytes().isascii())  # VTK before 9.5 refuses UTF-8
    return struct.pack("<BBHHHB", 3, 0, len(label), len(kind), len(space), 1) + label + kind + space + value.tobytes()


def storable(value):
    """`value` as an array HDF5 can hold: little endian, contiguous; booleans as bytes, text as UTF-8."""
    array = np.asarray(value)
    if array.dtype.kind == "b":
        array = array.astype(np.uint8)
    elif array.dtype.kind == "U":
        array = np.char.encode(array, "utf-8")
    if array.dtype.kind == "S" and array.dtype.itemsize == 0:
        array = array.astype("S1")
    datatype(array.dtype)  # refuses what cannot be stored
    array = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return array if array.flags.c_contiguous else np.ascontiguousarray(array)


def _messages(messages):
    return b"".join(struct.pack("<BHB", kind, len(data), 0) + data for kind, data in messages)


def _header(messages):
    body = _messages(messages)
    for _, data in messages:
        if len(data) > 0xFFFF:
            raise ValueError(f"a header message of {len(data)} bytes is too long; store it as a dataset")
    whole = b"OHDR" + struct.pack("<BBI", 2, 2, len(body)) + body
    return whole + struct.pack("<I", checksum(whole))


def _attributes(attrs):
    return [(_ATTRIBUTE, attribute(name, value)) for name, value in attrs.items()]


def group_header(links, attrs):
    """Object header of a group; `links` maps a name to an address, or to text: the path of a soft link.

    The order of creation is kept, because VTK reads the blocks of an assembly in that order.
    """
    messages = [
        (_LINK_INFO, struct.pack("<BBQQQQ", 0, 3, len(links), UNDEFINED, UNDEFINED, UNDEFINED)),
        (_GROUP_INFO, struct.pack("<BB", 0, 0)),
    ]
    for order, (name, target) in enumerate(links.items()):
        label = name.encode()
        soft = isinstance(target, str)
        # flags: length of the name in 2 bytes, creation order, type of link, character set
        head = struct.pack("<BBBQBH", 1, 0x1D, 1 if soft else 0, order, 1, len(label)) + label
        path = target.encode() if soft else b""
        messages.append((_LINK, head + (struct.pack("<H", len(path)) + path if soft else struct.pack("<Q", target))))
    return _header(messages + _attributes(attrs))


def dataset_header(dtype, shape, layout, attrs):
    """Object header of a dataset that does not grow; `layout` from `contiguous`."""
    return _header([*_fixed_messages(dtype, attrs), (_DATASPACE, dataspace(shape)), (_LAYOUT, layout)])


def _fixed_messages(dtype, attrs):
    return [(_DATATYPE, datatype(dtype)), (_FILL_VALUE, struct.pack("<BB", 3, 0x0A)), *_attributes(attrs)]


class GrowingHeader:
    """Object header of a dataset that grows along its first axis, made again and again: what changes stands last."""

    def __init__(self, dtype, row_shape, rows_per_chunk, attrs):
        self._row_shape, self._chunk, self._item = tuple(row_shape), (rows_per_chunk, *row_shape), np.dtype(dtype).itemsize
        whole = _header([*_fixed_messages(dtype, attrs), *self._changing(0, UNDEFINED)])
        changing = sum(4 + len(data) for _, data in self._changing(0, UNDEFINED)) + 4
        self._beginning = whole[:-changing]
        self._state = checksum_state(self._beginning, len(whole) - 4)

    def _changing(self, rows, index):
        return [(_DATASPACE, dataspace((rows, *self._row_shape), True)), (_LAYOUT, chunked(index, self._chunk, self._item))]

    def bytes(self, rows, index):
        """The header of `rows` rows, whose chunks the B-tree at `index` finds."""
        whole = self._beginning + _messages(self._changing(rows, index))
        return whole + struct.pack("<I", checksum(whole, self._state))


def contiguous(address, size):
    """Layout message of `size` bytes in one piece."""
    return struct.pack("<BBQQ", 3, 1, address, size)


def chunked(index, chunk_shape, item_size):
    """Layout message of chunks found through the B-tree at `index`."""
    numbers = (*chunk_shape, item_size)
    return struct.pack("<BBBQ", 3, 2, len(numbers), index) + struct.pack(f"<{len(numbers)}I", *numbers)


def tree_node(level, children, first_row, rows_per_child, last_row, rank, chunk_bytes):
    """Node of a B-tree over the chunks of an array cut along its first axis; always of its full size.

    Keys bound the children: key i is the first row of child i, the last key the row after all.
    """
    key = struct.Struct(f"<IIQ{8 * rank}x")
    parts = [b"TREE", struct.pack("<BBHQQ", 1, level, len(children), UNDEFINED, UNDEFINED)]
    for i, child in enumerate(children):
        parts.append(key.pack(chunk_bytes, 0, first_row + i * rows_per_child) + struct.pack("<Q", child))
    parts.append(key.pack(0, 0, last_row))
    return b"".join(parts).ljust(tree_node_size(rank), b"\0")


def tree_node_size(rank):
    """Bytes of a B-tree node over an array of `rank` axes."""
    key = 8 + 8 * (rank + 1)
    return 24 + CHILDREN * 8 + (CHILDREN + 1) * key
