"""Counter-parties of every codec, written from the formats' descriptions alone: they share no line with drivers or simulators.

Each gives the pieces of which a stream is made, so that a test can lose, repeat, swap and damage whole pieces as well as bytes.
"""

import struct
from collections.abc import Callable, Iterator
from random import Random

Pieces = list[bytes]


def _divided(byte: int, polynomial: int) -> int:
    """One byte divided by a polynomial of 16 bits, bit by bit: the entry of a table of checksums."""
    rest = byte << 8
    for _ in range(8):
        rest = rest << 1 ^ (polynomial if rest & 0x8000 else 0)
    return rest & 0xFFFF


TABLE = [_divided(byte, 0x1021) for byte in range(256)]


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE by a table of our own."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ TABLE[crc >> 8 ^ byte]
    return crc


def ascii_line(body: str, end: bytes = b"\r\n") -> bytes:
    """One line of the ASCII format: body, asterisk, checksum, line end."""
    return b"%s*%04X" % (body.encode(), crc16(body.encode())) + end


def ascii_pieces(rng: Random) -> Pieces:
    """A scan with late, repeated, wrapped and invalid points, heartbeats, greetings, openings said again, and a second scan."""
    opening = ascii_line(f"S,scanner,{rng.randint(1, 9)},{rng.choice(['mm', 'um', 'inch'])},{rng.choice(['', '40'])}")
    start = rng.choice([0, 0, 0, 2**32 - 8])
    lines = [rng.choice([b"", b"hello\r\n", ascii_line("Q,unknown")]), opening]
    lines += [ascii_line(f"H,{start},0")] if start else []
    for i in range(rng.randint(3, 30)):
        seq = (start + i) % 2**32
        lines.append(ascii_line(f"P,{seq},{i * 500},{i * 0.125},{-i},{rng.random():.6f},{rng.choice([0, 0, 0, 0, 1, 2])}"))
        if rng.random() < 0.1:
            lines.append(ascii_line(f"H,{(seq + rng.choice([0, 1, 3])) % 2**32},{i * 500}"))
        if rng.random() < 0.05:
            lines.append(rng.choice([opening, ascii_line("S,other,2,um,5"), b"*\r\n", ascii_line(f"P,{seq},1,1,1,1,0", b"\n")]))
    return [*lines, *rng.choice([[], [ascii_line(f"E,{i + 1}")], [ascii_line("E,99")]])]


def binary_frame(kind: int, seq: int, t_us: int, payload: bytes, flags: int = 0) -> bytes:
    """One frame of 24 bytes of the counted binary format."""
    head = struct.pack("<BBBBHI", 0xA5, 0x5A, kind, flags, seq & 0xFFFF, t_us & 0xFFFFFFFF) + payload
    return head + struct.pack("<H", crc16(head))


def crc32(data: bytes) -> int:
    """CRC-32 of IEEE 802.3, bit by bit, as its definition says."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def binary_block(seq: int, t_us: int, points: list[tuple[int, int, int, int]]) -> bytes:
    """One block of points (x, y, z in 1e-5 mm, flags)."""
    head = struct.pack("<BBHIQ", 0xA5, 0x5B, len(points), seq & 0xFFFFFFFF, t_us)
    head += struct.pack("<H", crc16(head))
    body = b"".join(struct.pack("<IiiiH", 10 * i, x, y, z, flags) for i, (x, y, z, flags) in enumerate(points))
    return head + body + struct.pack("<I", crc32(head + body))


def binary_pieces(rng: Random) -> Pieces:
    """Single frames, or blocks, between openings, heartbeats and a closing."""
    opening = binary_frame(0, 0, 0, struct.pack("<IQ", rng.randint(1, 3), rng.choice([0, 50])))
    pieces, number = [opening], 0
    blocks = rng.random() < 0.5
    for _ in range(rng.randint(2, 20)):
        size = rng.randint(1, 6) if blocks else 1
        points = [(number + k, -number, rng.randint(-(2**31), 2**31 - 1), rng.choice([0, 0, 0, 1, 4])) for k in range(size)]
        if blocks:
            pieces.append(binary_block(number, 100 * number, points))
        else:
            pieces.append(binary_frame(1, number, 100 * number + rng.randint(0, 60), struct.pack("<iii", *points[0][:3]), points[0][3]))
        number += size + (rng.choice([40_000, 70_000, 200_000]) if rng.random() < 0.05 else 0)
        if rng.random() < 0.1:
            pieces.append(binary_frame(2, number, 0, struct.pack("<Q4x", rng.choice([number, number + 2, 2**63, 2**64 - 1]))))
        if rng.random() < 0.05:
            pieces.append(rng.choice([opening, binary_frame(0, 0, 0, struct.pack("<IQ", 9, 9)), b"\xa5\x5a", b"\xa5\x5b\xff\xff"]))
    return [*pieces, *rng.choice([[], [binary_frame(3, 0, 0, struct.pack("<Q4x", number + rng.choice([0, 2])))]])]


def optoncdt_word(value: int, first: bool) -> bytes:
    """One value of 18 bits: six bits in each of three bytes, tagged 00, 01 and 10 or 11."""
    return bytes([value & 63, 0x40 | value >> 6 & 63, (0x80 if first else 0xC0) | value >> 12 & 63])


def optoncdt_pieces(rng: Random) -> Pieces:
    """Replies, then blocks of distance, counter and clock in the order told; replies in between."""
    extra = rng.choice([[], ["INTENSITY"], ["SHUTTER", "STATE"]])
    names = ["DIST1", *extra[:1], "COUNTER", "TIMESTAMPLO", "TIMESTAMPHI", *extra[1:]]
    pieces = [b"OUTPUT NONE\r\n->", b"GETOUTINFO_RS422 " + " ".join(names).encode() + b"\r\n->", b"OUTPUT RS422\r\n->"]
    counter, clock = rng.choice([0, 7, 2**18 - 5]), rng.choice([0, 2**32 - 300])
    for i in range(rng.randint(3, 40)):
        value = rng.choice([30_000 + i, 30_000 + i, 30_000 + i, 262_076, 640, 65_000])
        told = {"COUNTER": (counter + i) % 2**18, "TIMESTAMPLO": (clock + 100 * i) % 2**16, "TIMESTAMPHI": (clock + 100 * i) >> 16 & 0xFFFF}
        pieces += [optoncdt_word(value if not k else told.get(name, 5), first=not k) for k, name in enumerate(names)]
        if rng.random() < 0.05:
            pieces.append(rng.choice([b"OUTPUT RS422\r\n->", b"->", b"-", b">", b"E12 what\r\n->", b"COUNTER\r\n->", bytes([0, 0x40])]))
    return pieces


def riftek_pieces(rng: Random) -> Pieces:
    """Bursts of four bytes, some repeated, some counters left out."""
    pieces, count = [], rng.randint(0, 3)
    for i in range(rng.randint(3, 40)):
        value, count = rng.choice([500 + i, 16384, 16385, 65535]), (count + rng.choice([1, 1, 1, 1, 1, 2, 0])) % 4
        renewed = rng.choice([0x40, 0x40, 0x40, 0])
        pieces.append(bytes(0x80 | renewed | count << 4 | value >> 4 * place & 15 for place in range(4)))
    return pieces


def riftek_ascii_pieces(rng: Random) -> Pieces:
    """Answers, some of which are no number."""
    odd = [b"OK\r\n", b"-\r\n", b"1.5\n", b"\r\n", b"1.5.2\r\n", b"nan\r\n", b"1e9\r\n", b"\x00\r\n", 70 * b"1" + b"\r\n", b" 1.5\r\n"]
    return [rng.choice(odd) if rng.random() < 0.15 else b"%.3f\r\n" % (i * 0.5 - 3) for i in range(rng.randint(3, 60))]


def g800_pieces(rng: Random) -> Pieces:
    """Sets of nominal and measured points, some without the other, some labelled wrongly, some numbered anew."""
    end = rng.choice([b"\r\n", b"\r", b"\n"])
    pieces = [rng.choice([b"", b"RESULTSFILE A" + end]), b"START" + end, rng.choice([b"", b"\x12", b"RESULTSFILE B" + end, b"hello" + end])]
    for i in range(1, rng.randint(3, 30)):
        place = b"N%d X%.4f Y   -%.4f Z-.5" % (i % 20, i, i / 3)
        nominal, measured = b"G800 " + place + b" I0. J1. K0. O0. U.1 L-.1" + end, b"G801 " + place + b" R1.5" + end
        pieces += rng.choice(
            [*12 * [[nominal, measured]], [nominal], [measured], [nominal.replace(b"0 N", b"1 N"), measured], 2 * [measured]]
        )
        if rng.random() < 0.1:
            odd = [
                b"TOOLPATHID 4",
                b"G330 N1 A0. B0. X%d." % i,
                b"G802 N1 DEVIATION .1",
                b"G801 N1 X1.2.3",
                b"END",
                b"START",
                b"\x80",
                300 * b"7",
            ]
            pieces.append(rng.choice(odd) + end)
    return [*pieces, *rng.choice([[], [b"END" + end, b"START" + end, measured, b"END" + end]])]


def pattern_pieces(rng: Random) -> Pieces:
    """Lines with a number, some twice, some of another form."""
    odd = [b"(A)\r", b"M30\r", b"N1 X1 Y\r", b"N99 X1.2.3 Y1\r", b"\x14\r", b"POSN X1\r", 300 * b"1" + b"\r"]
    return [
        rng.choice(odd) if rng.random() < 0.1 else b"N%d X %.3f Y-  .5\r" % (i - rng.randint(0, 1), i) for i in range(1, rng.randint(4, 50))
    ]


STRANGE = (b"\x07\x01", b"\x04\x02\x00\x01", b"\x03\x02\x00\x01", b"\x18\x00\x02\x00\x00", b"\x90\x02")
JUNK = (b"\n", b"->", b"-", b"A", 700 * b"7", 4100 * b"x", 9000 * b"-")


class Registers:
    """A Modbus device that answers requests out of 65,536 registers; `turn` moves it on."""

    def __init__(self, turn: Callable[["Registers", Random], None], strange: bool) -> None:
        self.words = [0] * 65536
        self.queue: list[int] = []
        self.number = 0
        self._turn = turn
        self.strange = strange

    def put(self, at: int, code: str, value: float) -> None:
        """Write one big-endian number."""
        data = struct.pack(">" + code, value)
        for k in range(0, len(data), 2):
            self.words[at + k // 2] = data[k] << 8 | data[k + 1]

    def bytes_of(self, at: int, count: int) -> bytes:
        """Registers as they stand on the wire."""
        return b"".join(word.to_bytes(2, "big") for word in self.words[at : at + count])

    def answer(self, request: bytes, rng: Random) -> bytes:
        """Answer one request."""
        self._turn(self, rng)
        at = request[1] << 8 | request[2]
        if self.strange and rng.random() < 0.1:
            return rng.choice([*STRANGE, rng.randbytes(9), request])
        if request[0] == 24:
            words, self.queue = self.queue[:31], self.queue[31:]
            data = b"".join(word.to_bytes(2, "big") for word in words)
            return bytes([24]) + (len(data) + 2).to_bytes(2, "big") + len(words).to_bytes(2, "big") + data
        data = self.bytes_of(at, request[3] << 8 | request[4])
        return bytes([request[0], len(data)]) + data


def turn_ring(device: Registers, rng: Random) -> None:
    """Write a few points into the generic ring, now and then a damaged one, and its status."""
    if rng.random() < 0.5:
        for _ in range(rng.choice([1, 3, 12, 12, 520])):
            at = 100 + device.number % 500 * 11
            device.put(at, "H", device.number & 0xFFFF)
            device.put(at + 1, "I", device.number * 1000 & 0xFFFFFFFF)
            for axis in range(3):
                device.put(at + 3 + 2 * axis, "i", rng.choice([device.number * 100, -device.number, -(2**31)]))
            device.put(at + 9, "H", rng.choice([0, 0, 0, 1]))
            device.put(at + 10, "H", crc16(device.bytes_of(at, 10)) ^ (rng.random() < 0.02))
            device.number += 1
    status = ((0, "I", 0x434D4D31), (2, "I", device.number), (4, "H", 1), (5, "H", rng.random() < 0.05), (6, "H", rng.randint(0, 3)))
    for at, code, value in (*status, (7, "I", 0), (9, "I", device.number)):
        device.put(at, code, value)
    device.put(11, "H", crc16(device.bytes_of(0, 11)) ^ (rng.random() < 0.05))


def turn_fifo(device: Registers, rng: Random) -> None:
    """Put points into the queue of function 24."""
    while len(device.queue) < 40 and rng.random() < 0.7:
        data = struct.pack(">HIiii", device.number & 0xFFFF, device.number * 1000, device.number, -5, rng.choice([7, -(2**31)]))
        words = [data[k] << 8 | data[k + 1] for k in range(0, len(data), 2)]
        device.queue += [*words, crc16(data) ^ (rng.random() < 0.02)]
        device.number += rng.choice([1, 1, 1, 1, 3])
    if rng.random() < 0.02 and device.queue:
        device.queue.pop()
    for at, code, value in ((0, "I", 0x434D4D32), (4, "H", 1), (9, "I", device.number)):
        device.put(at, code, value)
    device.put(11, "H", crc16(device.bytes_of(0, 11)))


def turn_latest(device: Registers, rng: Random) -> None:
    """Renew the one point of `LATEST_MAP`, with now and then a float that is none."""
    if rng.random() < 0.7:
        device.number += rng.choice([1, 1, 1, 2, 0, -1, 70_000])
        device.put(10, "Q", device.number % 2**64)
        device.put(14, "d", rng.choice([*24 * [device.number % 1000 * 0.5], 1e200, float("nan")]))
        device.put(18, "f", rng.choice([*24 * [1.5], 1e-40]))


def turn_queue(device: Registers, rng: Random) -> None:
    """Renew the message of the Gocator's registers: whoever reads it takes it."""
    device.words[300] = 1
    if rng.random() < 0.7:
        device.number += rng.choice([1, 1, 1, 2])
        for at, code, value in ((988, "q", device.number), (992, "q", device.number * 500), (996, "q", device.number)):
            device.put(at, code, value)
        device.put(1000, "I", rng.choice([250, 0x80000000, 70_000]))
        device.words[1002] = 1
    device.words[978] = rng.random() < 0.05


LATEST_MAP = {
    "device": "latest",
    "pattern": "latest",
    "points": {
        "at": 10,
        "fields": {"sequence": {"at": 0, "type": "uint64"}, "x": {"at": 4, "type": "float64"}, "y": {"at": 8, "type": "float32"}},
    },
}
TURNS: dict[str, Callable[[Registers, Random], None]] = {
    "generic-ring": turn_ring,
    "generic-fifo": turn_fifo,
    "latest": turn_latest,
    "gocator": turn_queue,
}
PIECES: dict[str, Callable[[Random], Pieces]] = {
    "ascii": ascii_pieces,
    "binary": binary_pieces,
    "optoncdt": optoncdt_pieces,
    "riftek": riftek_pieces,
    "riftek-ascii": riftek_ascii_pieces,
    "g800": g800_pieces,
    "pattern": pattern_pieces,
}


def damaged(pieces: Pieces, rng: Random) -> bytes:
    """Lose, repeat, swap and shorten pieces, put junk between them, turn bits over; in about a third of the cases nothing."""
    pieces = list(pieces)
    for _ in range(rng.choice([0, 0, 1, 1, 2, 4])):
        at = rng.randrange(len(pieces)) if pieces else 0
        for kind in rng.choices(["lose", "repeat", "swap", "shorten", "junk", "flip"]):
            piece = pieces[at] if pieces else b""
            if kind == "lose":
                del pieces[at : at + rng.choice([1, 1, 4])]
            elif kind == "repeat":
                pieces[at:at] = pieces[max(0, at - rng.choice([1, 3])) : at + 1]
            elif kind == "swap" and pieces:
                other = rng.randrange(len(pieces))
                pieces[at], pieces[other] = pieces[other], pieces[at]
            elif kind == "shorten" and pieces:
                pieces[at] = piece[: rng.randint(0, len(piece))]
            elif kind == "junk":
                pieces.insert(at, rng.choice([rng.randbytes(rng.choice([1, 3, 30])), *JUNK]))
            elif kind == "flip" and piece:
                bit = rng.randrange(8 * len(piece))
                pieces[at] = (int.from_bytes(piece, "big") ^ 1 << bit).to_bytes(len(piece), "big")
    return b"".join(pieces)


def cuttings(length: int, rng: Random) -> Iterator[list[int]]:
    """Places to cut so many bytes: none, each byte, and some at random, with empty pieces among them."""
    yield []
    if length <= 3000:
        yield list(range(1, length))
    for most in (3, 40):
        yield sorted(rng.randint(0, length) for _ in range(rng.randint(1, most)))
