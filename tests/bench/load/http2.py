# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""HTTP/2 as no library would speak it (RFC 9113): half-sent requests, streams that are reset at once."""

import socket
import ssl
import struct
import time

_DATA, _HEADERS, _RST_STREAM, _SETTINGS, _PING, _GOAWAY, _WINDOW_UPDATE, _CONTINUATION = 0, 1, 3, 4, 6, 7, 8, 9
_END_STREAM, _END_HEADERS, _ACK = 1, 4, 1
_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
_CANCEL = 8
MAX_FRAME = 16384


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + struct.pack(">BBI", kind, flags, stream) + payload


def _number(number, mask):
    """In as many bits as the mask has, and further bytes (RFC 7541, 5.1)."""
    if number < mask:
        return bytes([number])
    more, number = bytearray([mask]), number - mask
    while number >= 128:
        more.append(number & 127 | 128)
        number >>= 7
    return bytes(more) + bytes([number])


def literal(name, value, kept=False):
    """A header without Huffman's code, which the dynamic table keeps or no table does (RFC 7541, 6.2)."""
    return (b"\x40" if kept else b"\0") + b"".join(
        _number(len(text), 127) + text for text in (name.encode(), value.encode()))


def request_headers(method, authority="localhost", more=()):
    return b"".join(literal(*each) for each in [
        (":method", "POST"), (":scheme", "http"), (":path", "/ccslice.v1.SlicerService/" + method),
        (":authority", authority), ("te", "trailers"), ("content-type", "application/grpc"), *more])


def headers_frame(stream, block, ends=True):
    return frame(_HEADERS, _END_HEADERS if ends else 0, stream, block)


def continuation_frame(stream, block, ends=False):
    return frame(_CONTINUATION, _END_HEADERS if ends else 0, stream, block)


def reset_frame(stream):
    return frame(_RST_STREAM, 0, stream, struct.pack(">I", _CANCEL))


def data_frame(stream, payload, last=False):
    return frame(_DATA, _END_STREAM if last else 0, stream, payload)


class Connection:
    """Sends what it is told, within the windows that the server grants."""

    def __init__(self, address, source=None, tls=False, acknowledges=True):
        host, port = address.rsplit(":", 1)
        self._socket = socket.create_connection((host, int(port)), timeout=10,
                                                source_address=(source, 0) if source else None)
        if tls:
            context = ssl.create_default_context()
            context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            context.set_alpn_protocols(["h2"])
            self._socket = context.wrap_socket(self._socket)
        self._buffer = b""
        self._window = 65535
        self._windows = {}
        self._initial_window = 65535
        self._next_stream = 1
        self.acknowledges = acknowledges  # The settings of the server.
        self.closed = False
        self.goaway = None  # What the server says of the end.
        self.received = {}  # Bytes of data, by stream.
        self.send(_PREFACE + frame(_SETTINGS, 0, 0))

    def fileno(self):
        return self._socket.fileno()

    def close(self):
        self._socket.close()

    def send(self, frames):
        try:
            self._socket.sendall(frames)
        except OSError:
            self.closed = True

    def next_stream(self):
        self._next_stream += 2
        return self._next_stream - 2

    def open_stream(self, method, more=()):
        stream = self.next_stream()
        self._windows[stream] = self._initial_window
        self.send(headers_frame(stream, request_headers(method, more=more)))
        return stream

    def is_answered(self, method, timeout_s):
        """Calls it with an empty request. Whether an answer comes within that time."""
        stream = self.open_stream(method)
        self.send(data_frame(stream, b"\0" * 5, last=True))
        end = time.monotonic() + timeout_s
        while not self.closed and stream not in self.received and time.monotonic() < end:
            self.receive(max(0.001, end - time.monotonic()))
        return stream in self.received

    def send_data(self, stream, data, timeout_s):
        """As many bytes of `data` as the windows let through. How many that were."""
        sent = 0
        while sent < len(data) and not self.closed:
            room = min(self._window, self._windows.get(stream, 0), MAX_FRAME, len(data) - sent)
            if room <= 0:
                if not self.receive(timeout_s):
                    break
                continue
            self.send(data_frame(stream, data[sent:sent + room]))
            self._window -= room
            self._windows[stream] -= room
            sent += room
        return sent

    def receive(self, timeout_s):
        """Takes in what comes. Whether anything did."""
        self._socket.settimeout(timeout_s)
        try:
            more = self._socket.recv(1 << 16)
        except OSError as error:
            self.closed = self.closed or not isinstance(error, TimeoutError)
            return False
        finally:
            self._socket.settimeout(10)
        if not more:
            self.closed = True
            return False
        self._buffer += more
        while len(self._buffer) >= 9:
            length = int.from_bytes(self._buffer[:3], "big")
            if len(self._buffer) < 9 + length:
                break
            kind, flags, stream = struct.unpack(">BBI", self._buffer[3:9])
            self._take(kind, flags, stream, self._buffer[9:9 + length])
            self._buffer = self._buffer[9 + length:]
        return True

    def _take(self, kind, flags, stream, payload):
        if kind == _SETTINGS and not flags & _ACK:
            for i in range(0, len(payload), 6):
                name, value = struct.unpack(">HI", payload[i:i + 6])
                if name == 4:
                    for open_stream in self._windows:
                        self._windows[open_stream] += value - self._initial_window
                    self._initial_window = value
            if self.acknowledges:
                self.send(frame(_SETTINGS, _ACK, 0))
        elif kind == _PING and not flags & _ACK:
            self.send(frame(_PING, _ACK, 0, payload))
        elif kind == _DATA:
            self.received[stream] = self.received.get(stream, 0) + len(payload)
        elif kind == _WINDOW_UPDATE:
            more = struct.unpack(">I", payload)[0]
            if stream == 0:
                self._window += more
            elif stream in self._windows:
                self._windows[stream] += more
        elif kind == _RST_STREAM:
            self._windows.pop(stream, None)
        elif kind == _GOAWAY:
            self.goaway = payload
