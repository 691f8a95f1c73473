"""Deflate (RFC 1951) of 16-bit samples by one Huffman code of their bytes, compiled."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

LONGEST = 13
"""Bits of a code, so that those of a sample's two bytes and their number fit into 32."""
_END_OF_BLOCK = 256
_DYNAMIC = 2
_LENGTH_BITS = 5
_CHANNELS = 3
_ADLER = np.uint64(65521)


@dataclass(frozen=True)
class Code:
    """A code, and the head of a block that says which.

    samples: (65536,) the code of a sample, its high byte first, times 32, plus the number of its bits.
    literals, end: the same of the single bytes and of a block's end. head: (value, bits).
    """

    samples: npt.NDArray[np.uint32]
    literals: npt.NDArray[np.uint32]
    end: int
    head: tuple[int, int]


def code_for(counts: npt.NDArray[np.int64]) -> Code:
    """The best code for bytes that are as frequent as counts (256,) says; none needs to have been seen."""
    lengths = _lengths([*(int(n) + 1 for n in counts), 1])
    codes = _canonical(lengths)
    packed = np.array(
        [code << _LENGTH_BITS | length for code, length in zip(codes, lengths, strict=True)],
        np.uint32,
    )
    literals = packed[:_END_OF_BLOCK]
    bits = literals & ((1 << _LENGTH_BITS) - 1)
    first, second = literals[:, None] >> _LENGTH_BITS, literals[None, :] >> _LENGTH_BITS
    both = first | second << bits[:, None]
    samples = both << _LENGTH_BITS | (bits[:, None] + bits[None, :])
    return Code(
        samples.ravel().astype(np.uint32), literals, int(packed[_END_OF_BLOCK]), _head(lengths)
    )


def _lengths(counts: Sequence[int]) -> list[int]:
    """Of each symbol's code: Huffman's, of flatter counts where that makes codes too long."""
    order = count()
    heap: list[tuple[int, int, tuple[int, ...]]] = [
        (n, next(order), (symbol,)) for symbol, n in enumerate(counts)
    ]
    heapq.heapify(heap)
    lengths = [0] * len(counts)
    while len(heap) > 1:
        n, _, rare = heapq.heappop(heap)
        m, _, other = heapq.heappop(heap)
        for symbol in rare + other:
            lengths[symbol] += 1
        heapq.heappush(heap, (n + m, next(order), rare + other))
    return lengths if max(lengths) <= LONGEST else _lengths([n // 2 + 1 for n in counts])


def _canonical(lengths: Sequence[int]) -> list[int]:
    """The codes that these lengths stand for (RFC 1951, 3.2.2), the first bit lowest."""
    codes, code = [0] * len(lengths), 0
    for length in range(1, max(lengths) + 1):
        for symbol in (s for s, own in enumerate(lengths) if own == length):
            codes[symbol] = int(f"{code:0{length}b}"[::-1], 2)
            code += 1
        code <<= 1
    return codes


def _head(lengths: Sequence[int]) -> tuple[int, int]:
    """Of a block with these lengths, each told in four bits, and a single distance, which is not used."""
    four = [int(f"{n:04b}"[::-1], 2) for n in range(16)]
    fields = [(0, 1), (_DYNAMIC, 2), (len(lengths) - 257, 5), (0, 5), (19 - 4, 4)]
    fields += [(0, 3)] * 3 + [(4, 3)] * 16 + [(four[n], 4) for n in (*lengths, 1)]
    value = size = 0
    for field, bits in fields:
        value, size = value | field << size, size + bits
    return value, size


def block(samples: npt.NDArray[np.uint16], row_start: int, code: Code) -> tuple[bytes, int]:
    """(rows, n) samples as blocks that end at a byte's edge, and the Adler-32 (RFC 1950) of what is in them.

    That is, of each row, the byte row_start, and then of each sample the two bytes, the high one first,
    each less that of three samples before.
    """
    value, bits = code.head
    whole = bits // 32
    worst = samples.shape[0] * (samples.shape[1] * 2 + 1) * LONGEST
    words = np.empty(whole + worst // 32 + 1, np.uint32)
    words[:whole] = [value >> 32 * word & 0xFFFFFFFF for word in range(whole)]
    begun = np.array([whole, value >> 32 * whole, bits % 32], np.uint64)
    at, value, bits, adler = map(
        int, _coded(samples, row_start, code.literals, code.samples, words, begun)
    )
    value |= (code.end >> _LENGTH_BITS) << bits
    bits += (code.end & 31) + 3  # of an empty stored block, which ends at a byte's edge
    tail = value.to_bytes((bits + 7) // 8, "little") + b"\x00\x00\xff\xff"
    return b"".join((words[:at].data, tail)), adler


@njit(cache=True, nogil=True)
def _coded(samples: Any, row_start: int, literals: Any, codes: Any, words: Any, begun: Any) -> Any:
    """Where in words the code goes on, the bits that are not in them yet, their number, and Adler-32."""
    at, value, bits = begun[0], begun[1], begun[2]
    low, high = np.uint64(1), np.uint64(0)
    length = np.uint64(samples.shape[1])
    less = np.empty(length, np.uint16)
    for row in range(samples.shape[0]):
        _less_left(samples[row], less)
        total, weighted = _sums(less)
        low += np.uint64(row_start)
        high = (high + low + np.uint64(2) * length * low + weighted) % _ADLER
        low = (low + total) % _ADLER
        at, value, bits = _put(literals[row_start], words, at, value, bits)
        for i in range(length):
            at, value, bits = _put(codes[less[i]], words, at, value, bits)
    return at, value, bits, high << np.uint64(16) | low


@njit(cache=True, nogil=True)
def _less_left(line: Any, less: Any) -> None:
    """Each byte less that of the pixel to the left, modulo 256."""
    high, low = np.uint16(0xFF00), np.uint16(0xFF)
    less[:_CHANNELS] = line[:_CHANNELS]
    for i in range(np.uint64(len(line) - _CHANNELS)):
        here, left = line[i + _CHANNELS], line[i]
        less[i + _CHANNELS] = ((here & high) - (left & high)) & high | (here - left) & low


@njit(cache=True, nogil=True)
def _sums(less: Any) -> Any:
    """Of the bytes, and of the bytes each times how many there are from it to the end."""
    total, weighted = np.uint64(0), np.uint64(0)
    length = np.uint64(len(less))
    for i in range(length):
        high, low = np.uint32(less[i] >> np.uint16(8)), np.uint32(less[i] & np.uint16(0xFF))
        both = high + low
        total += np.uint64(both)
        weighted += np.uint64(both * np.uint32(np.uint32(2) * np.uint32(length - i)) - low)
    return total, weighted


@njit(cache=True, nogil=True)
def _put(entry: Any, words: Any, at: Any, value: Any, bits: Any) -> Any:
    value |= (np.uint64(entry) >> np.uint64(_LENGTH_BITS)) << bits
    bits += np.uint64(entry) & np.uint64(31)
    words[at] = np.uint32(value)
    return at + (bits >> np.uint64(5)), value >> (bits & np.uint64(32)), bits & np.uint64(31)
