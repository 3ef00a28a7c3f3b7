"""Ways to spoil bytes and trees."""

import copy
import re
import struct

PLAIN = """
nan inf -inf -1 0 1e400 1e-400 1e9 ~ null true no * &a !!set {{ [ | ../../etc /dev/null 0x10 1_000 2001-99-99 <<
= % @ structured free traction
"""
WORDS = (*PLAIN.split(), "9" * 30, "", " ", "é", "\u202e", "x" * 300, "\t", "1e-9 mm", "1e9 mm", "5 mm", "5 m m",
         "5 mm^9^9", "200 GPa", "1 kN")  # fmt: skip
"""Values that are seldom meant."""


def spoil_bytes(random, content, words=()):
    """Bytes with some of them changed, cut, doubled, swapped, or words put among them."""
    content = bytearray(content)
    for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
        at = random.randrange(len(content) + 1)
        length = min(len(content) - at, random.choice((1, 1, 2, 4, 16, 64, 300)))
        kind = random.randrange(8)
        if kind == 0 and at < len(content):
            content[at] ^= 1 << random.randrange(8)
        elif kind == 1:
            content[at : at + length] = random.randbytes(length)
        elif kind == 2:
            del content[at : at + length]
        elif kind == 3:
            del content[at:]
        elif kind == 4:
            content[at:at] = content[at : at + length] * random.choice((1, 1, 2, 40))
        elif kind == 5 and len(content) > length:
            other = random.randrange(len(content) - length)
            content[at : at + length] = content[other : other + length]
        elif kind == 6 and words:
            content[at : at + random.choice((0, length))] = random.choice(words).encode()
        elif kind == 7:
            content[at : at + length] = bytes(length)
        if not content:
            break
    return bytes(content)


COUNTS = (4_000_000_000, 100_000_000, 2**62, 10**6)
"""Counts that no file of some kilobytes has."""


def spoil_counts(random, content):
    """Bytes with a whole number of the text, or 4 or 8 of the bytes, in place of a count that cannot be."""
    count = random.choice(COUNTS)
    numbers = list(re.finditer(rb"(?<![\w.+-])\d+(?![\w.])", content))
    if numbers and (b"\0" not in content or random.random() < 0.3):
        found = random.choice(numbers)
        return content[: found.start()] + str(count).encode() + content[found.end() :]
    form = random.choice(("<Q", "<I", ">Q", ">I"))
    new = struct.pack(form, count % 2 ** (64 if form[1] == "Q" else 32))
    at = random.randrange(max(1, len(content) - len(new)))
    return content[:at] + new + content[at + len(new) :]


def places(tree, path=()):
    """Paths to all that a tree holds."""
    found = [path]
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        found += places(value, (*path, key))
    return found


def nested(value, depth):
    """A value in lists of lists."""
    for _ in range(depth):
        value = [value]
    return value


def spoil_tree(random, tree):
    """Tree of dicts, lists and texts with some of what it holds taken out, doubled, swapped or replaced."""
    tree = copy.deepcopy(tree)
    for _ in range(random.choice((1, 1, 2, 2, 4))):
        path = random.choice(places(tree))
        if not path:
            continue
        *above, key = path
        holder, other = tree, tree
        for step in above:
            holder = holder[step]
        for step in random.choice(places(tree)):
            other = other[step]
        value, word = holder[key], random.choice(WORDS)
        kind = random.randrange(9)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[word] = value
        else:
            holder[key] = (
                word,
                None,
                [value] * random.choice((0, 1, 2, 30)),
                {word: value},
                copy.deepcopy(other),
                [f"{1 + number / 1000:g} mm" for number in range(random.choice((3, 300, 30000)))],
                value.replace(random.choice("0123456789 "), word) if isinstance(value, str) else word,
                nested(value, random.choice((5, 40, 200))),
            )[kind - 1]
        if len(places(tree)) > 40_000:
            break
    return tree
