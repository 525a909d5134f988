"""What pages cost a running brachyd: viewer_load.py NAME HTTP_PORT PID SECONDS PAGES; called by viewer_load.sh.

Two pages read for SECONDS, one the surface and one the volume; then PAGES more subscribe to the volume and read
nothing. Prints a row. Exit code 1: over 2 MB of surface in a second.
"""
import select
import socket
import struct
import sys
import time

SURFACE_LIMIT = 2e6  # bytes in any second
FRAME, SURFACE = 4, 4  # message type; subscription bit


class Page:
    """A WebSocket connection to brachyd that has said HELLO."""

    def __init__(self, port, subscription, receive_buffer=None):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect(("127.0.0.1", port))
        self.socket.sendall(
            (
                f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
            ).encode()
        )
        answer = b""
        while not answer.endswith(b"\r\n\r\n"):
            answer += self.socket.recv(1)
        assert answer.startswith(b"HTTP/1.1 101"), answer
        name = b"viewer_load"
        self.sequence = 0
        self.send(1, struct.pack("<HHI4dH", 1, 0, subscription, *4 * (float("nan"),), len(name)) + name + bytes(4))
        self.unread = bytearray()
        self.frames = []  # (time, bytes on the wire)
        self.snapshot = 0
        self.dropped = 0

    def send(self, message_type, body):
        self.sequence += 1
        message = (
            b"BRCY" + struct.pack("<HHIIQQ", 1, message_type, 0, len(body), self.sequence, time.monotonic_ns()) + body
        )
        assert len(message) < 126
        self.socket.sendall(struct.pack(">BBI", 0x82, 0x80 | len(message), 0) + message)  # masked with 0

    def read(self):
        self.unread += self.socket.recv(1 << 20)
        while len(self.unread) >= 10:
            size = self.unread[1]
            header = {126: 4, 127: 10}.get(size, 2)
            if header > 2:
                size = int.from_bytes(self.unread[2:header], "big")
            if len(self.unread) < header + size:
                return
            message = bytes(self.unread[header : header + size])
            del self.unread[: header + size]
            message_type = struct.unpack_from("<H", message, 6)[0]
            if message_type == FRAME:
                self.frames.append((time.monotonic(), header + size))
                snapshot = struct.unpack_from("<Q", message, 32 + 24)[0]
                self.dropped += snapshot - self.snapshot - 1 if self.snapshot else 0
                self.snapshot = snapshot
            elif message_type == 9 and message[40] == 0:  # PING
                nonce, stamp = struct.unpack_from("<Q", message, 32)[0], struct.unpack_from("<Q", message, 24)[0]
                self.send(9, struct.pack("<QB7xQQ", nonce, 1, stamp, time.monotonic_ns()))

    def rates(self):
        """Mean and the most in any second, bytes/s, after the first frame."""
        frames = self.frames[1:]
        mean = sum(size for _, size in frames) / (frames[-1][0] - self.frames[0][0])
        first = most = total = 0
        for at, size in frames:
            total += size
            while frames[first][0] <= at - 1:
                total -= frames[first][1]
                first += 1
            most = max(most, total)
        return mean, most


def resident_mb(pid):
    with open(f"/proc/{pid}/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:")) / 1024


def read_for(pages, seconds):
    end = time.monotonic() + seconds
    by_socket = {page.socket: page for page in pages}
    while (left := end - time.monotonic()) > 0:
        for ready in select.select(list(by_socket), [], [], left)[0]:
            by_socket[ready].read()


def main():
    name, port, pid, seconds, asleep = sys.argv[1], *map(int, sys.argv[2:])
    pages = [Page(port, SURFACE), Page(port, 0)]
    read_for(pages, seconds)
    before = resident_mb(pid)
    sleepers = [Page(port, 0, receive_buffer=4096) for _ in range(asleep)]
    read_for(pages, 3)  # less than the 5 s after which they are closed
    during = resident_mb(pid)
    for page in sleepers:
        page.socket.close()
    read_for(pages, 0.5)
    after = resident_mb(pid)
    (surface, surface_most), (volume, volume_most) = (page.rates() for page in pages)
    dropped = sum(page.dropped for page in pages)
    print(
        f"{name:<16} surface {surface / 1e6:5.2f} MB/s, at most {surface_most / 1e6:5.2f};  "
        f"volume {volume / 1e6:5.2f}, "
        f"at most "
        f"{volume_most / 1e6:5.2f};  resident {before:6.1f} MB, with {asleep} pages asleep "
        f"{during:6.1f}, after {after:6.1f};  "
        f"{dropped} snapshots dropped",
        flush=True,
    )
    return 0 if surface_most <= SURFACE_LIMIT else 1


sys.exit(main())
