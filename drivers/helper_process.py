"""A library in a process of its own: questions go down one pipe, answers come up the other.

Why a process: some libraries stop every thread of a program while they load or work, print what they like, and crash on bad files.
Acquisition must never wait for that, `--json` must not be spoiled, and a crash shall cost a message and not the run.

A message is a line of JSON, then the bytes of the arrays that it announces. The child says hello first; it ends with its pipe, whatever
it works on, and what its libraries print goes to its standard error, which nobody reads.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

Message = tuple[dict[str, Any], list[NDArray[Any]]]
Answer = Callable[[dict[str, Any], list[NDArray[Any]]], Message]

_CHILD: Final = "import sys; sys.path.append(sys.argv[1]); from {module} import serve; serve()"


class HelperProcess:
    """A running child that serves the questions of one module.

    module : its full name; its function `serve` is what the child runs, see `answer_questions`
    python : the command that starts Python
    """

    def __init__(self, module: str, python: Sequence[str] = (sys.executable,)) -> None:
        self._module, self._python = module, tuple(python)
        self._child = start_child(module, self._python)

    @property
    def ended(self) -> bool:
        """Whether the child is gone: it broke down on a question, or was killed."""
        return self._child.poll() is not None

    def start_again(self) -> None:
        """Put a new child in the place of one that is gone: a bad file must not spoil the next."""
        self.close()
        self._child = start_child(self._module, self._python)

    def ask(self, request: dict[str, Any], arrays: Sequence[NDArray[Any]] = ()) -> Message:
        """Send a question and wait for its answer. Raises ChildProcessError, with the exit status, where the child ends instead."""
        assert self._child.stdin is not None
        try:
            _send(self._child.stdin, request, arrays)
        except OSError as error:
            raise ChildProcessError(f"exit status {self._child.wait()}") from error
        return self.receive()

    def receive(self) -> Message:
        """Wait for the next message. Raises ChildProcessError, with the exit status, where the child ends instead."""
        assert self._child.stdout is not None
        message = _read_message(self._child.stdout)
        if message is None:
            raise ChildProcessError(f"exit status {self._child.wait()}")
        return message

    def close(self) -> None:
        """End the child; it has nothing to save."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._child.kill()
        self._child.wait()
        self._child.stdout.close()
        with suppress(OSError):  # what was still to be sent has no receiver any more
            self._child.stdin.close()


def start_child(module: str, python: Sequence[str]) -> subprocess.Popen[bytes]:
    """Start the child of a module. Returns at once."""
    root = str(Path(__file__).resolve().parents[1])
    command = [*python, "-P", "-c", _CHILD.format(module=module), root]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


def answer_questions(load: Callable[[], tuple[dict[str, Any], Answer | None]]) -> None:
    """Run as the child: load the library, say hello, answer until the pipe closes, and end with it.

    load : gives the first message, and what answers questions; None where the library cannot be loaded, and the child ends
    """
    pipe_in, pipe_out = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get among the answers
    questions: SimpleQueue[Message] = SimpleQueue()
    Thread(target=_listen, args=(pipe_in, questions), name="questions", daemon=True).start()
    hello, answer = load()
    _send(pipe_out, hello, [])
    while answer is not None:
        _send(pipe_out, *answer(*questions.get()))


def _listen(pipe: IO[bytes], questions: "SimpleQueue[Message]") -> None:
    """Hand on questions. Where the pipe ends nobody waits for an answer: the process ends at once, whatever it works on."""
    while (message := _read_message(pipe)) is not None:
        questions.put(message)
    os._exit(0)


def _send(pipe: IO[bytes], message: dict[str, Any], arrays: Sequence[NDArray[Any]]) -> None:
    pipe.write(json.dumps({**message, "arrays": [[array.dtype.str, list(array.shape)] for array in arrays]}).encode() + b"\n")
    for array in arrays:
        pipe.write(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    pipe.flush()


def _read_message(pipe: IO[bytes]) -> Message | None:
    """Read what `_send` wrote; None at the end of the pipe."""
    line = pipe.readline()
    if not line.endswith(b"\n"):
        return None
    message = json.loads(line)
    arrays = []
    for dtype, shape in message.pop("arrays"):
        array = np.empty(shape, np.dtype(dtype))
        data = pipe.read(array.nbytes)
        if len(data) < array.nbytes:
            return None
        arrays.append(np.frombuffer(data, array.dtype).reshape(shape))
    return message, arrays
