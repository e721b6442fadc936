"""Calls of kernels in WebAssembly, in Node or in a browser: chunks of calls go out by HTTP, results come back."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from subprocess import DEVNULL, Popen
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any

import numpy as np

from graphsynth.core.native.wasm import MODULES
from graphsynth.workbench import __file__ as _workbench

from .kernel_bits import leaves, same_bits, same_results

LOADER = Path(_workbench).with_name("pages") / "kernels.js"
RUNNER = Path(__file__).with_name("wasm_runner.js")
_DTYPES = {"?": "?", "b": "i1", "B": "u1", "h": "i2", "H": "u2", "i": "i4", "I": "u4", "l": "i8", "L": "u8"}
_DTYPES |= {"f": "f4", "d": "f8", "D": "c16"}
PAGE = b"""<!doctype html><script src="/kernels.js"></script><script src="/wasm_runner.js"></script>
<script>serve(Kernels, location.origin).then(() => { document.title = "done"; });</script>"""


def tables() -> dict[str, dict[str, Any]]:
    """Return the tables of all modules."""
    return {path.stem: json.loads(path.read_text("utf-8")) for path in sorted(MODULES.glob("*.json"))}


class Remote:
    """Kernels that run elsewhere: `call` makes a chunk of calls."""

    def __init__(self, start: Callable[[str], tuple[Popen[bytes], Callable[[], None]]], seconds: float = 600.0) -> None:
        self._chunks: Queue[bytes] = Queue()
        self._found: Queue[bytes | str] = Queue()
        self._seconds = seconds
        remote = self

        class Handler(BaseHTTPRequestHandler):
            # one connection, and answers in one piece: small chunks would wait for each other
            protocol_version, wbufsize, disable_nagle_algorithm = "HTTP/1.1", -1, True

            def log_message(self, format: str, *args: Any) -> None: ...

            def _answer(self, body: bytes, kind: str = "application/octet-stream") -> None:
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def do_GET(self) -> None:
                name = self.path.lstrip("/")
                if not name:
                    self._answer(PAGE, "text/html")
                    return
                folder = {"kernels.js": LOADER.parent, "wasm_runner.js": RUNNER.parent}.get(name, MODULES)
                path = folder / Path(name).name
                kind = {".js": "text/javascript", ".json": "application/json"}.get(path.suffix, "application/wasm")
                self._answer(path.read_bytes() if path.is_file() else b"", kind)

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
                if self.path == "/next":  # answered in time: who asks gives up after some minutes
                    try:
                        self._answer(remote._chunks.get(timeout=60.0))
                    except Empty:
                        self._answer(_packed({"wait": True}, []))
                    return
                remote._found.put(body.decode() if self.path == "/failed" else body)
                self._answer(b"")

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self._process, self._stop = start(f"http://127.0.0.1:{self._server.server_port}")
        self._tables = tables()

    def close(self) -> None:
        self._chunks.put(_packed({"end": True}, []))
        self._stop()
        self._server.shutdown()
        self._server.server_close()

    def call(
        self, module: str, kernel: str, args: tuple[Any, ...], blocks: list[Any], count: int
    ) -> tuple[list[Any], list[np.ndarray]]:
        """Make ``count`` calls; ``blocks``: every leaf of ``args``, an array or a float with one more axis,
        a whole number once, or as a list of one for each call.

        Returned are the results, of a call that raises the name of the error's class, and the arrays afterwards.
        """
        self.ask(_described(module, kernel, args, blocks, count, 0.0))
        return self.read(self.found(), module, kernel, args, blocks, count)

    def read(
        self, found: bytes, module: str, kernel: str, args: tuple[Any, ...], blocks: list[Any], count: int
    ) -> tuple[list[Any], list[np.ndarray]]:
        """Read results and arrays of calls."""
        calls = self._tables[module]["kernels"][kernel]["calls"]
        assert len({result for _, _, result, *_ in calls}) == 1
        reader = _Reader(found)
        results = [reader.result(calls[0][2]) for _ in range(count)]
        arrays = [
            reader.array(block.dtype, block.shape)
            for leaf, block in zip(leaves(args), blocks, strict=True)
            if isinstance(leaf, np.ndarray)
        ]
        assert reader.at == len(found)
        return results, arrays

    def seconds(self, module: str, kernel: str, args: tuple[Any, ...], seconds: float) -> float:
        """Return how long one call takes, by calls for some seconds."""
        blocks = [np.asarray(leaf)[None] if isinstance(leaf, np.ndarray | float) else leaf for leaf in leaves(args)]
        self.ask(_described(module, kernel, args, blocks, 1, seconds))
        return float(np.frombuffer(self.found())[0])

    def ask(self, chunk: bytes) -> None:
        """Send a chunk."""
        self._chunks.put(chunk)

    def found(self) -> bytes:
        """Wait for what comes back."""
        end = monotonic() + self._seconds
        while True:
            try:
                found = self._found.get(timeout=5.0)
                break
            except Empty:
                if monotonic() > end or self._process.poll() is not None:
                    raise RuntimeError("no answer: the kernels elsewhere have ended, or take too long") from None
        if isinstance(found, str):
            raise RuntimeError(found)
        return found


class Both:
    """Kernels in Node and in a headless Chromium: the same calls in each."""

    def __init__(self) -> None:
        self.places = node(), browser()

    def close(self) -> None:
        for place in self.places:
            place.close()

    def call(
        self, module: str, kernel: str, args: tuple[Any, ...], blocks: list[Any], count: int
    ) -> tuple[list[Any], list[np.ndarray]]:
        """Make calls as `Remote.call`; raises if results differ, except in the bits of a NaN."""
        chunk = _described(module, kernel, args, blocks, count, 0.0)
        for place in self.places:
            place.ask(chunk)
        first, second = (place.found() for place in self.places)
        read = self.places[0].read
        results, arrays = read(first, module, kernel, args, blocks, count)
        if first != second:
            others, more = read(second, module, kernel, args, blocks, count)
            same = same_results(results, others) and all(map(same_bits, arrays, more))
            assert same, f"Node and Chromium differ: {kernel}"
        return results, arrays


def _described(module: str, kernel: str, args: tuple[Any, ...], blocks: list[Any], count: int, seconds: float) -> bytes:
    """Write a chunk of calls."""
    numbers = iter(range(len(blocks)))
    described, data, at = [], [], 0
    for leaf, block in zip(leaves(args), blocks, strict=True):
        if isinstance(leaf, np.ndarray | float):
            block = np.ascontiguousarray(block)
            kind = "b1" if block.dtype == bool else block.dtype.str[1:]
            what = "array" if isinstance(leaf, np.ndarray) else "float"
            described.append({"kind": what, "type": kind, "shape": list(block.shape[1:]), "at": at})
            data.append(block)
            at += (block.nbytes + 15) // 16 * 16
        elif leaf is None or isinstance(leaf, bool | np.bool_):
            described.append({"kind": "constant", "value": None if leaf is None else bool(leaf)})
        else:
            values = list(map(str, block)) if isinstance(block, list) else None
            described.append({"kind": "whole", "value": str(int(leaf)), "values": values})
    head = {"module": module, "kernel": kernel, "count": count, "leaves": described, "seconds": seconds}
    return _packed(head | {"tree": _tree(args, numbers)}, data)


def _tree(args: tuple[Any, ...], numbers: Iterator[int]) -> list[Any]:
    return [_tree(part, numbers) if isinstance(part, tuple) else next(numbers) for part in args]


def _packed(head: dict[str, Any], data: list[np.ndarray]) -> bytes:
    text = json.dumps(head).encode()
    parts = [len(text).to_bytes(8, "little"), text, bytes(-len(text) % 8)]
    for block in data:
        parts += [block.tobytes(), bytes(-block.nbytes % 16)]
    return b"".join(parts)


class _Reader:
    """Reads results by the codes of their types."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def _take(self, size: int) -> bytes:
        self.at += size
        return self.data[self.at - size : self.at]

    def array(self, dtype: Any, shape: tuple[int, ...]) -> np.ndarray:
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        return np.frombuffer(self._take(size), dtype=dtype).reshape(shape)

    def result(self, code: str) -> Any:
        if size := self._take(1)[0]:
            return self._take(size).decode()
        found, rest = self._one(code)
        assert not rest
        return found

    def _one(self, code: str) -> tuple[Any, str]:
        if code[0] == "(":
            parts, rest = [], code[1:]
            while rest[0] != ")":
                part, rest = self._one(rest)
                parts.append(part)
            return tuple(parts), rest[1:]
        if code[0] == "A":
            shape = tuple(np.frombuffer(self._take(8 * int(code[2])), dtype=np.int64).tolist())
            return self.array(_DTYPES[code[1]], shape), code[5:]
        if code[0] == "N":
            return None, code[1:]
        if code[0] in "df":
            return float(np.frombuffer(self._take(8))[0]), code[1:]
        if code[0] == "D":
            return complex(*np.frombuffer(self._take(16)).tolist()), code[1:]
        value = int(np.frombuffer(self._take(8), dtype=np.int64)[0])
        return (bool(value) if code[0] == "?" else value % 2**64 if code[0] == "L" else value), code[1:]


def node() -> Remote:
    """Kernels in Node."""

    def start(address: str) -> tuple[Popen[bytes], Callable[[], None]]:
        program = shutil.which("node")
        assert program is not None
        process = Popen([program, str(RUNNER), str(LOADER), address])
        return process, lambda: process.wait(30) and None

    return Remote(start)


def browser() -> Remote:
    """Kernels in a headless Chromium."""

    def start(address: str) -> tuple[Popen[bytes], Callable[[], None]]:
        program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        assert program is not None
        folder = TemporaryDirectory()
        flags = (
            "--headless=new --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-sync"
        )
        command = [program, *flags.split(), f"--user-data-dir={folder.name}", "--remote-debugging-port=0", address]
        process = Popen(command, stderr=DEVNULL)

        def stop() -> None:
            process.terminate()
            process.wait(30)
            folder.cleanup()

        return process, stop

    return Remote(start)
