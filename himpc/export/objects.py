"""Machine code of the exported controller for a target, by LLVM: an object file with a plain C interface."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import llvmlite.binding as llvm

from himpc.compilation.compiled import kept
from himpc.export.entries import EXPORTED, PREFIX, entries_text, kernel_text
from himpc.export.kernel.whole_tick import control
from himpc.export.layout import layout_number
from robots.errors import InputError, unknown_name


@dataclass(frozen=True)
class Target:
    """A target of the code.

    Attributes:
        triple: LLVM's name of the target.
        features: features of the processor beyond those that all processors of its kind have.
        bits: number of bits of a pointer.
        ending: ending of the object file's name.
        compiler: a C compiler that links the replay for the target.
    """

    triple: str
    features: str = ""
    bits: int = 64
    ending: str = "o"
    compiler: str = "cc"


TARGETS: dict[str, Target] = {
    "wasm32": Target(
        "wasm32-unknown-unknown",
        "+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint",
        bits=32,
        ending="wasm",
    ),
    "x86_64-linux": Target("x86_64-unknown-linux-gnu"),
    "aarch64-linux": Target("aarch64-unknown-linux-gnu", compiler="aarch64-linux-gnu-gcc"),
    "x86_64-macos": Target("x86_64-apple-macosx11.0.0"),
    "aarch64-macos": Target("arm64-apple-macosx11.0.0"),
    "x86_64-windows": Target("x86_64-pc-windows-msvc", ending="obj", compiler="clang"),
}
"""The targets by the names that the command accepts."""

MATHEMATICS = frozenset({"sin", "cos", "tan", "atan2", "hypot", "exp", "expm1", "log", "sqrt", "pow"})
"""Functions of libm that exported code is allowed to call."""
_MEMORY = frozenset({"memcpy", "memset", "memmove"})
_COUNTS = re.compile(r"^define [^\n]*@(NRT_incref|NRT_decref)\(.*?^\}\n", re.MULTILINE | re.DOTALL)


_STRUCTURES = re.compile(r"(?:= alloca |getelementptr [\w ]*)(?:\[\d+ x )?(?:%|\{[^}\n]*ptr)")
"""Matches local variables that are structures with pointers, and addresses inside such a structure. A
structure of numbers is the same for all targets, whose integers of 64 bits all begin at multiples of 8."""


def target_named(name: str) -> Target:
    """Returns a target. Raises InputError if the name is unknown."""
    if name not in TARGETS:
        raise unknown_name("target", name, TARGETS)
    return TARGETS[name]


def object_code(target: Target, prefix: str = PREFIX) -> bytes:
    """Returns an object file for a target; it is kept on disk. Names of functions begin with `prefix`.

    Raises:
        InputError: this build of LLVM cannot make code for the target.
    """
    key = "-".join([target.triple, _own_digest(), *([] if prefix == PREFIX else [prefix])])
    return kept(control.py_func, key, lambda: _made(target, prefix))


def _made(target: Target, prefix: str) -> bytes:
    machine, head = _machine(target)
    text = _retargeted(_portable(), head)
    for name in EXPORTED:
        text = re.sub(rf"@{name}\b", f"@{prefix}{name.removeprefix(PREFIX)}", text)
    whole = llvm.parse_assembly(text)
    whole.verify()
    _optimise(whole, machine, llvm.create_pipeline_tuning_options(speed_level=2))
    foreign = {symbol.name for symbol in whole.functions if symbol.is_declaration}
    foreign = {name for name in foreign if not name.startswith("llvm.")} - MATHEMATICS - _MEMORY
    if foreign:
        raise RuntimeError(f"the exported code must not call {', '.join(sorted(foreign))}")
    return machine.emit_object(whole)


def _portable() -> str:
    """Returns the text of all functions for all targets; it is kept on disk.

    Numba's text is for pointers of eight bytes. Here all calls that pass structures with pointers are
    inlined, and the structures are replaced by their elements. The resulting text is also valid for targets
    with pointers of another size. Loops are vectorised later, for each target.
    """

    def make() -> bytes:
        name, parts = kernel_text()
        machine, head = _machine(Target("x86_64-unknown-linux-gnu"))
        whole = llvm.parse_assembly(head + entries_text(name, layout_number()))
        for part in parts:
            whole.link_in(llvm.parse_assembly(_retargeted(part, head)))
        for symbol in (*whole.functions, *whole.global_variables):
            if not symbol.is_declaration and symbol.name not in EXPORTED:
                symbol.linkage = "internal"
        tuning = llvm.create_pipeline_tuning_options(speed_level=2)
        tuning.loop_vectorization = tuning.slp_vectorization = tuning.loop_unrolling = False
        _optimise(whole, machine, tuning)
        text = str(whole)
        if _STRUCTURES.search(text):
            raise RuntimeError("the layout of a structure depends on the size of a pointer")
        return zlib.compress(text.encode())

    return zlib.decompress(kept(control.py_func, f"portable-{_own_digest()}", make)).decode()


def _own_digest() -> str:
    """Returns a digest of the source files that turn the LLVM code of Numba into object files."""
    own = b"".join(Path(__file__).with_name(name).read_bytes() for name in ("objects.py", "entries.py"))
    return sha256(own).hexdigest()[:8]


def _machine(target: Target) -> tuple[llvm.TargetMachine, str]:
    """Returns LLVM's generator for a target, and the first lines of a text for it. Raises InputError if LLVM
    has no such target."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    try:
        llvm_target = llvm.Target.from_triple(target.triple)
    except RuntimeError:
        raise InputError(f"the LLVM of this llvmlite makes no code for {target.triple}") from None
    reloc = "static" if target.bits == 32 else "pic"
    machine = llvm_target.create_target_machine(features=target.features, opt=3, reloc=reloc)
    return machine, f'target datalayout = "{machine.target_data}"\ntarget triple = "{target.triple}"\n'


def _optimise(whole: llvm.ModuleRef, machine: llvm.TargetMachine, tuning: llvm.PipelineTuningOptions) -> None:
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(whole, builder)


def _retargeted(text: str, head: str) -> str:
    """Returns a module for another target, without reference counts. A tick allocates nothing and needs
    none."""
    text = _COUNTS.sub(r"define linkonce_odr void @\1(ptr %p) {\n  ret void\n}\n", text)
    for name in re.findall(r"^define linkonce_odr void @(\w+)\(ptr %p\)", text, re.MULTILINE):
        text = re.sub(rf"^declare .*@{name}\(.*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r'^target (datalayout|triple) = ".*"\n', "", text, flags=re.MULTILINE)
    text = re.sub(r"^declare .*@llvm\.x86\..*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r'"(?:target-cpu|target-features|tune-cpu)"="[^"]*" ?', "", text)
    return head + text
