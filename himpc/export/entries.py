"""The C interface of an exported controller, as LLVM text. Its functions find the arrays in a controller's
memory and call `control`."""

from __future__ import annotations

import struct

from himpc.compilation.compiled import INDICES, VECTOR, WHOLE, intermediate
from himpc.export.kernel.whole_tick import RESET, TICK, control

ARRAYS = (
    *("data", "where", "whole", "whole_where", "loop", "loop_where"),
    *("pairs", "pairs_where", "pairs_whole", "pairs_whole_where"),
)
"""The arrays of a controller, in the order of the arguments of `control`."""
MAGIC, LAYOUT, SIZE, JOINTS, FIRST = range(5)
"""Indices of the words at the beginning of a controller's memory: a constant that marks such a memory, the
number of the kernel's layout, the number of bytes, and the number of joints. From FIRST on, each array of
ARRAYS has two words: the byte at which it begins and its number of elements."""
NAMES = FIRST + 2 * len(ARRAYS)
"""Index of the word with a digest of the names of controller, robot, joints, tasks and levels."""
DIGEST = NAMES + 1
"""Index of the word with the digest of all other words of an image: it names the controller with all its
numbers, and it shows whether a bit of the image is wrong."""
WORDS = 32
"""Number of these words, 8 bytes each."""
SIGN = struct.unpack("<q", b"himpclab")[0]
_START, _PRIME = 0xCBF29CE484222325, 0x100000001B3
EXPORTED = ("himpc_tick", "himpc_reset", "himpc_set", "himpc_check")
"""The functions of the object file, unless their names begin with another prefix than PREFIX."""
PREFIX = "himpc"
_TYPES = (
    *(VECTOR, INDICES, INDICES, INDICES, VECTOR, INDICES, VECTOR, INDICES, INDICES, INDICES),
    *(WHOLE, WHOLE, VECTOR, VECTOR, VECTOR, VECTOR),
)
_ARRAY = "ptr, ptr, i64, i64, ptr, i64, i64"


def digest_of(image: bytes) -> int:
    """Returns the digest of an image, 64 bits: FNV-1a over words of 8 bytes, with the word DIGEST as 0. After
    each word the upper half is folded into the lower half. Each step can be inverted, so two images that
    differ in one word have different digests."""
    whole, digest = (1 << 64) - 1, _START
    for index, (word,) in enumerate(struct.iter_unpack("<Q", image)):
        digest = ((digest ^ (0 if index == DIGEST else word)) * _PRIME) & whole
        digest ^= digest >> 32
    return digest


def kernel_text() -> tuple[str, list[str]]:
    """Returns the name of the compiled `control` and the modules of its text."""
    return intermediate(control.py_func, _TYPES)


def entries_text(control_name: str, layout: int) -> str:
    """Returns the functions in EXPORTED.

    Args:
        control_name: the name that `kernel_text` returns.
        layout: the number that a controller's memory must have for this kernel.
    """
    return (
        # An exported controller reads no clock, and the times of its levels are zero.
        "define i32 @clock_gettime(i32 %clock, i64 %stamp) {\n  ret i32 -1\n}\n"
        f"declare i32 @{control_name}(ptr, ptr, "
        f"{', '.join([_ARRAY] * len(ARRAYS))}, i64, i64, {', '.join([_ARRAY] * 4)})\n"
        + _entry(
            "himpc_tick",
            "ptr %q, ptr %v, ptr %tau_applied, ptr %tau",
            "  %given = icmp ne ptr %tau_applied, null\n  %index = zext i1 %given to i64\n"
            "  %z = select i1 %given, ptr %tau_applied, ptr %q\n",
            control_name,
            (f"i64 {TICK}", "i64 %index"),
            [("%q", "%n"), ("%v", "%n"), ("%z", "%n"), ("%tau", "%n")],
        )
        + _entry(
            "himpc_reset",
            "ptr %tau",
            "  %given = icmp ne ptr %tau, null\n  %index = zext i1 %given to i64\n"
            "  %x = select i1 %given, ptr %tau, ptr %c\n",
            control_name,
            (f"i64 {RESET}", "i64 %index"),
            [("%x", "%n")] * 4,
        )
        + _entry(
            "himpc_set",
            "i32 %what, i32 %index, ptr %values, i32 %count",
            "  %w = zext i32 %what to i64\n  %i = sext i32 %index to i64\n  %k = sext i32 %count to i64\n",
            control_name,
            ("i64 %w", "i64 %i"),
            [("%values", "%k")] * 4,
        )
        + f"""
define i32 @himpc_check(ptr %c, i32 %size, i64 %digest) {{
  %enough = icmp uge i32 %size, {8 * WORDS}
  br i1 %enough, label %look, label %no
look:
{_word(MAGIC, "magic", 1)}{_word(LAYOUT, "layout", 1)}{_word(SIZE, "bytes", 1)}{_word(DIGEST, "stored", 1)}
  %given = zext i32 %size to i64
  %a = icmp eq i64 %magic, {SIGN}
  %b = icmp eq i64 %layout, {layout}
  %d = icmp eq i64 %bytes, %given
  %ab = and i1 %a, %b
  %abd = and i1 %ab, %d
  br i1 %abd, label %mine, label %no
mine:
  %count = lshr i64 %given, 3
  %same = icmp eq i64 %stored, %digest
  br i1 %same, label %loop, label %other
loop:
  %k = phi i64 [0, %mine], [%next, %loop]
  %h = phi i64 [{_signed(_START)}, %mine], [%mixed, %loop]
  %at = getelementptr i64, ptr %c, i64 %k
  %read = load i64, ptr %at, align 1
  %own = icmp eq i64 %k, {DIGEST}
  %word = select i1 %own, i64 0, i64 %read
  %x = xor i64 %h, %word
  %m = mul i64 %x, {_PRIME}
  %upper = lshr i64 %m, 32
  %mixed = xor i64 %m, %upper
  %next = add i64 %k, 1
  %more = icmp ult i64 %next, %count
  br i1 %more, label %loop, label %end
end:
  %whole = icmp eq i64 %mixed, %stored
  %r = select i1 %whole, i32 0, i32 -3
  ret i32 %r
other:
  ret i32 -2
no:
  ret i32 -1
}}
"""
    )


def _word(index: int, name: str, align: int = 8) -> str:
    where = f"  %{name}.at = getelementptr i8, ptr %c, i64 {8 * index}\n"
    return where + f"  %{name} = load i64, ptr %{name}.at, align {align}\n"


def _signed(word: int) -> int:
    return word - (1 << 64) if word >> 63 else word


def _entry(
    name: str,
    arguments: str,
    before: str,
    control_name: str,
    what: tuple[str, str],
    array_arguments: list[tuple[str, str]],
) -> str:
    """Returns a function that calls `control`. It returns 6 (HOLD) if `control` ends with a fault."""
    body, passed = _word(JOINTS, "n"), []
    for index, array in enumerate(ARRAYS):
        body += _word(FIRST + 2 * index, f"{array}.offset") + _word(FIRST + 2 * index + 1, f"{array}.count")
        body += f"  %{array} = getelementptr i8, ptr %c, i64 %{array}.offset\n"
        passed.append(_array(f"%{array}", f"%{array}.count"))
    passed += [*what, *(_array(*argument) for argument in array_arguments)]
    return f"""
define i32 @{name}(ptr %c, {arguments}) {{
{before}{body}  %result = alloca i64
  %fault = alloca ptr
  store i64 0, ptr %result
  %status = call i32 @{control_name}(ptr %result, ptr %fault, {", ".join(passed)})
  %found = load i64, ptr %result
  %short = trunc i64 %found to i32
  %fine = icmp eq i32 %status, 0
  %r = select i1 %fine, i32 %short, i32 6
  ret i32 %r
}}
"""


def _array(pointer: str, count: str) -> str:
    return f"ptr null, ptr null, i64 {count}, i64 8, ptr {pointer}, i64 {count}, i64 8"
