"""Calls of kernels in WebAssembly, in Node or in a browser: chunks of calls go out by HTTP, results come back."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from graphsynth.core.native.wasm import MODULES
from graphsynth.workbench import __file__ as _workbench

from .kernel_bits import leaves

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

    def __init__(self, start: Callable[[str], Callable[[], None]], seconds: float = 600.0) -> None:
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
        self._stop = start(f"http://127.0.0.1:{self._server.server_port}")
        self._tables = tables()

    def close(self) -> None:
        self._chunks.put(_packed({"end": True}, []))
        self._stop()
        self._server.shutdown()
        self._server.server_close()

    def call(
        self, module: str, kernel: str, args: tuple[Any, ...], blocks: list[Any], count: int
    ) -> tuple[list[Any], list[np.ndarray]]:
        """Make ``count`` calls; ``blocks``: every leaf of ``args``, an array or a float with one more axis.

        Returned are the results, of a call that raises the name of the error's class, and the arrays afterwards.
        """
        found = self._ask(module, kernel, args, blocks, count, 0.0)
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
        return float(np.frombuffer(self._ask(module, kernel, args, blocks, 1, seconds))[0])

    def _ask(
        self, module: str, kernel: str, args: tuple[Any, ...], blocks: list[Any], count: int, seconds: float
    ) -> bytes:
        """Send a chunk, and wait for what comes back."""
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
                described.append({"kind": "whole", "value": str(int(leaf))})
        tree = _tree(args, numbers)
        self._chunks.put(
            _packed(
                {
                    "module": module,
                    "kernel": kernel,
                    "count": count,
                    "tree": tree,
                    "leaves": described,
                    "seconds": seconds,
                },
                data,
            )
        )
        found = self._found.get(timeout=self._seconds)
        if isinstance(found, str):
            raise RuntimeError(found)
        return found


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

    def start(address: str) -> Callable[[], None]:
        program = shutil.which("node")
        assert program is not None
        process = subprocess.Popen([program, str(RUNNER), str(LOADER), address])
        return lambda: process.wait(30) and None

    return Remote(start)


def browser() -> Remote:
    """Kernels in a headless Chromium."""

    def start(address: str) -> Callable[[], None]:
        program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        assert program is not None
        folder = TemporaryDirectory()
        flags = (
            "--headless=new --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-sync"
        )
        command = [program, *flags.split(), f"--user-data-dir={folder.name}", "--remote-debugging-port=0", address]
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL)

        def stop() -> None:
            process.terminate()
            process.wait(30)
            folder.cleanup()

        return stop

    return Remote(start)
