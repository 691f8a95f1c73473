#!/usr/bin/env python3
"""Prints an AVR ELF's flash, static RAM and worst stack; fails where one is over its limit.

    footprint.py ELF FLASH_LIMIT RAM_LIMIT STACK_LIMIT

The stack is a bound, not a measurement: the deepest path through the calls in the disassembly, what
each function pushes and reserves on it, and on top of main's the deepest of every interrupt that
lets others in (each can be there once) and the deepest of those that do not.
"""

import re
import subprocess
import sys
from dataclasses import dataclass, field

_FUNCTION = re.compile(r"^[0-9a-f]+ <([^>]+)>:$")
_INSTRUCTION = re.compile(
    r"^ +[0-9a-f]+:\t(?:[0-9a-f]{2} )+ *\t(\S+)(?:\t([^;]*))?(?:;.*?<([^>]+)>)?"
)
_FRAME_POINTER = re.compile(r"r28, 0x([0-9A-F]+)", re.IGNORECASE)
_FRAME_POINTER_HIGH = re.compile(r"r29, 0x([0-9A-F]+)", re.IGNORECASE)
_ENDS = ("ret", "reti", "jmp", "rjmp", "ijmp")


@dataclass
class Function:
    """bytes: pushed and reserved by itself. calls: with a return address; jumps: without, among
    them going on into the next function."""

    bytes: int = 0
    calls: set[str] = field(default_factory=set)
    jumps: set[str] = field(default_factory=set)
    calls_through_pointer: bool = False
    lets_interrupts_in: bool = False


def main() -> int:
    elf, *limits = sys.argv[1:]
    flash, ram = _sizes(elf)
    return_bytes = 3 if "avr:6" in _run("avr-objdump", "-f", elf) else 2
    stack = _worst_stack(_functions(elf, return_bytes), return_bytes)
    names = ("flash", "static RAM", "worst stack")
    used = dict(zip(names, zip((flash, ram, stack), map(int, limits), strict=True), strict=True))
    print("   " + elf + ": " + ", ".join(f"{n} {u} of {m} B" for n, (u, m) in used.items()))
    over = [name for name, (size, limit) in used.items() if size > limit]
    if over:
        print(f"   {' and '.join(over)} over the limit", file=sys.stderr)
    return len(over)


def _sizes(elf: str) -> tuple[int, int]:
    sections = dict(re.findall(r"^\.(\w+) +(\d+)", _run("avr-size", "-A", elf), re.MULTILINE))
    text, data, bss, kept = (int(sections.get(s, 0)) for s in ("text", "data", "bss", "noinit"))
    return text + data, data + bss + kept


def _functions(elf: str, return_bytes: int) -> dict[str, Function]:
    functions: dict[str, Function] = {}
    name, function, last, moved = "", Function(), "ret", 0
    for line in _run("avr-objdump", "-d", elf).splitlines():
        if start := _FUNCTION.match(line):
            if last not in _ENDS:
                function.jumps.add(start[1])
            name, function = start[1], functions.setdefault(start[1], Function())
            continue
        if not (instruction := _INSTRUCTION.match(line)):
            continue
        last, operands, target = instruction.groups(default="")
        label = target.split("+")[0]
        if last == "push" or (last == "rcall" and operands.strip() == ".+0"):
            # A call to the next line only reserves room.
            function.bytes += 1 if last == "push" else return_bytes
        elif last in ("sbiw", "subi") and (number := _FRAME_POINTER.match(operands)):
            moved = int(number[1], 16)
        elif last == "sbci" and (number := _FRAME_POINTER_HIGH.match(operands)):
            moved += 256 * int(number[1], 16)
        elif last == "out" and operands.startswith("0x3d, r28"):
            function.bytes += moved if moved < 0x8000 else 0  # else it is given back
        elif last in ("call", "rcall"):
            function.calls.add(label)
        elif last in ("icall", "eicall"):
            function.calls_through_pointer = True
        elif label != name and (last in ("jmp", "rjmp") or last.startswith("br")):
            function.jumps.add(label)
        elif last == "sei":
            function.lets_interrupts_in = True
    return functions


def _worst_stack(functions: dict[str, Function], return_bytes: int) -> int:
    named = set().union(*(f.calls | f.jumps for f in functions.values()))
    pointed_at = [n for n in functions if n not in named and not n.startswith("_") and n != "main"]
    depths: dict[str, int] = {}

    def depth(name: str, path: tuple[str, ...] = ()) -> int:
        if name not in depths:
            function, way = functions[name], (*path, name)
            through = pointed_at if function.calls_through_pointer else []
            if again := function.calls.intersection(way):
                raise SystemExit(f"{name} calls {again.pop()} again: the stack has no bound")
            calls = [return_bytes + depth(n, way) for n in {*function.calls, *through}]
            jumps = [depth(n, way) for n in function.jumps if n in functions and n not in way]
            depths[name] = function.bytes + max(calls + jumps, default=0)
        return depths[name]

    interrupts = [n for n in functions if re.fullmatch(r"__vector_\d+", n)]
    nesting = [return_bytes + depth(n) for n in interrupts if functions[n].lets_interrupts_in]
    others = [return_bytes + depth(n) for n in interrupts if not functions[n].lets_interrupts_in]
    return return_bytes + depth("main") + sum(nesting) + max(others)


def _run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


sys.exit(main())
